/*{
    "DESCRIPTION": "A faded print: lifted blacks, warm lights over cool shadows, grain, a vignette",
    "CREDIT": "passgraph",
    "CATEGORIES": ["Film"],
    "ISFVSN": "2",
    "INPUTS": [
        {"NAME": "inputImage", "TYPE": "image"},
        {"NAME": "fade", "TYPE": "float", "MIN": 0, "MAX": 1, "DEFAULT": 0.5, "LABEL": "Lift of the blacks"},
        {"NAME": "warmth", "TYPE": "float", "MIN": 0, "MAX": 1, "DEFAULT": 0.5, "LABEL": "Split of tones"},
        {"NAME": "grain", "TYPE": "float", "MIN": 0, "MAX": 1, "DEFAULT": 0.35, "LABEL": "Grain"},
        {"NAME": "edges", "TYPE": "float", "MIN": 0, "MAX": 1, "DEFAULT": 0.4, "LABEL": "Vignette"}
    ]
}*/

// Noise of whole numbers (the PCG hash), the same on every device.
float noise(uvec2 at, uint frame) {
    uint state = (at.x + 4099u * at.y + 8388617u * frame) * 747796405u + 2891336453u;
    uint word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return float((word >> 22u) ^ word & 0xFFFFu) / 65535.0;
}

void main() {
    vec4 c = IMG_THIS_PIXEL(inputImage);
    vec3 s = c.rgb * c.rgb * (3.0 - 2.0 * c.rgb);
    vec3 print = mix(c.rgb, mix(vec3(0.07), vec3(0.94), s), fade);
    float y = dot(print, vec3(0.2126, 0.7152, 0.0722));
    vec3 split = mix(vec3(-0.03, 0.01, 0.05), vec3(0.06, 0.02, -0.05), y);
    uvec2 at = uvec2(gl_FragCoord.xy);
    float specks = noise(at, uint(FRAMEINDEX)) + noise(at + 7919u, uint(FRAMEINDEX)) - 1.0;
    vec2 away = isf_FragNormCoord - 0.5;
    print += warmth * split + 0.16 * grain * specks * (1.0 - y * y);
    gl_FragColor = vec4(print * (1.0 - 1.6 * edges * dot(away, away)), c.a);
}
