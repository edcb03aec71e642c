#version 330
// Six-sided tiles, each of one colour, with a bevel that is lit from above.
uniform sampler2D image;
uniform float side = 12.0; // of a tile, pixels
uniform float bevel = 0.5;
in vec2 uv;
out vec4 color;

void main() {
    vec2 size = vec2(textureSize(image, 0)), at = uv * size;
    vec2 pitch = side * vec2(1.7320508, 3.0);
    vec2 a = (floor(at / pitch) + 0.5) * pitch;
    vec2 b = floor(at / pitch + 0.5) * pitch;
    vec2 da = at - a, db = at - b;
    bool first = dot(da, da) < dot(db, db);
    vec2 middle = first ? a : b, d = (first ? da : db) / side;
    vec4 c = vec4(0.0);
    for (int i = 0; i < 9; i++)
        c += texture(image, (middle + side * 0.5 * (vec2(i % 3, i / 3) - 1.0)) / size);
    c /= 9.0;
    vec2 q = abs(d);
    float rim = max(q.x * 1.1547005, q.x * 0.57735027 + q.y);
    float shade = bevel * smoothstep(0.7, 1.0, rim) * (d.y > 0.0 ? 0.35 : -0.35);
    color = vec4(c.rgb * (1.0 + shade) * (1.0 - smoothstep(0.93, 1.0, rim) * 0.6), c.a);
}
