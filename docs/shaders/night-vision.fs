/*{
    "DESCRIPTION": "An image intensifier: amplified luma on green or white phosphor, noise, lines, the tube's edge",
    "CREDIT": "passgraph",
    "CATEGORIES": ["Color Effect"],
    "ISFVSN": "2",
    "INPUTS": [
        {"NAME": "inputImage", "TYPE": "image"},
        {"NAME": "gain", "TYPE": "float", "MIN": 0, "MAX": 8, "DEFAULT": 2.5, "LABEL": "Gain"},
        {"NAME": "noise", "TYPE": "float", "MIN": 0, "MAX": 1, "DEFAULT": 0.4, "LABEL": "Noise"},
        {"NAME": "phosphor", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["Green", "White"], "DEFAULT": 0},
        {"NAME": "tube", "TYPE": "bool", "DEFAULT": true, "LABEL": "Round"}
    ]
}*/

float grains(uvec2 at) {
    uint n = at.x * 1597334677u ^ at.y * 3812015801u ^ uint(FRAMEINDEX) * 2654435769u;
    n = (n ^ (n >> 15u)) * 2246822519u;
    return float((n ^ (n >> 13u)) & 65535u) / 65535.0;
}

void main() {
    vec2 at = gl_FragCoord.xy;
    vec4 c = IMG_THIS_PIXEL(inputImage);
    float y = gain * dot(c.rgb, vec3(0.35, 0.5, 0.15));
    y = y / (1.0 + 0.6 * y);
    y += 0.35 * noise * (grains(uvec2(at) / 2u) - 0.5) * (1.3 - y);
    y *= (uint(at.y) / 2u) % 2u == 0u ? 0.88 : 1.0;
    vec3 shade = phosphor == 0 ? vec3(0.18, 1.0, 0.3) : vec3(0.75, 0.95, 1.0);
    vec3 lit = shade * y + 0.4 * max(y - 0.8, 0.0);
    if (tube) {
        vec2 away = (2.0 * at - RENDERSIZE) / RENDERSIZE.y;
        lit *= 1.0 - smoothstep(0.9, 1.1, length(away * vec2(0.72, 1.0)));
    }
    gl_FragColor = vec4(lit, c.a);
}
