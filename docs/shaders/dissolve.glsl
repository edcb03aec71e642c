// Burns from one picture to the other along cells of noise.
// Author: passgraph
uniform float cells; // = 14.0
uniform float glow; // = 0.06
uniform vec3 ember; // = vec3(1.0, 0.45, 0.1)

float corner(ivec2 at) {
    uint n = uint(at.x) * 1597334677u ^ uint(at.y) * 3812015801u;
    n = (n ^ (n >> 15u)) * 2246822519u;
    return float((n ^ (n >> 13u)) & 65535u) / 65535.0;
}

float noise(vec2 at) {
    ivec2 cell = ivec2(floor(at));
    vec2 f = fract(at), u = f * f * (3.0 - 2.0 * f);
    return mix(mix(corner(cell), corner(cell + ivec2(1, 0)), u.x),
               mix(corner(cell + ivec2(0, 1)), corner(cell + ivec2(1, 1)), u.x), u.y);
}

vec4 transition(vec2 uv) {
    vec2 at = uv * vec2(ratio, 1.0) * cells;
    float n = 0.6 * noise(at) + 0.3 * noise(2.0 * at + 31.0) + 0.1 * noise(4.0 * at + 57.0);
    float burnt = progress * (1.0 + 2.0 * glow) - glow - n;
    float heat = 1.0 - clamp(abs(burnt) / glow, 0.0, 1.0);
    vec4 c = burnt > 0.0 ? getToColor(uv) : getFromColor(uv);
    return vec4(c.rgb + ember * heat * heat, c.a);
}
