/*{
    "DESCRIPTION": "What is bright glows: cut out at a quarter of the size, blurred each way, added",
    "CREDIT": "passgraph",
    "CATEGORIES": ["Blur", "Glow"],
    "ISFVSN": "2",
    "INPUTS": [
        {"NAME": "inputImage", "TYPE": "image"},
        {"NAME": "threshold", "TYPE": "float", "MIN": 0, "MAX": 1, "DEFAULT": 0.6, "LABEL": "What is bright"},
        {"NAME": "strength", "TYPE": "float", "MIN": 0, "MAX": 2, "DEFAULT": 0.9, "LABEL": "Strength"},
        {"NAME": "tint", "TYPE": "color", "DEFAULT": [1.0, 0.85, 0.7, 1.0], "LABEL": "Colour"}
    ],
    "PASSES": [
        {"TARGET": "bright", "WIDTH": "$WIDTH/4", "HEIGHT": "$HEIGHT/4", "FLOAT": true},
        {"TARGET": "across", "WIDTH": "$WIDTH/4", "HEIGHT": "$HEIGHT/4", "FLOAT": true},
        {"TARGET": "around", "WIDTH": "$WIDTH/4", "HEIGHT": "$HEIGHT/4", "FLOAT": true},
        {}
    ]
}*/

vec4 cut() {
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 4; i++)
        sum += IMG_NORM_PIXEL(inputImage, isf_FragNormCoord + (vec2(i & 1, i >> 1) - 0.5) * 0.5 / RENDERSIZE);
    vec3 c = 0.25 * sum.rgb;
    float y = max(c.r, max(c.g, c.b));
    return vec4(c * max(y - threshold, 0.0) / max(y, 0.001), 1.0);
}

void main() {
    if (PASSINDEX == 0) {
        gl_FragColor = cut();
    } else if (PASSINDEX < 3) {
        vec4 sum = vec4(0.0);
        float weights = 0.0;
        for (int i = -8; i <= 8; i++) {
            float weight = float((9 - abs(i)) * (9 - abs(i)));
            if (PASSINDEX == 1)
                sum += weight * IMG_NORM_PIXEL(bright, isf_FragNormCoord + vec2(i, 0) / RENDERSIZE);
            else
                sum += weight * IMG_NORM_PIXEL(across, isf_FragNormCoord + vec2(0, i) / RENDERSIZE);
            weights += weight;
        }
        gl_FragColor = sum / weights;
    } else {
        vec4 c = IMG_THIS_PIXEL(inputImage);
        vec3 light = strength * 4.0 * tint.rgb * IMG_NORM_PIXEL(around, isf_FragNormCoord).rgb;
        gl_FragColor = vec4(1.0 - (1.0 - min(c.rgb, 1.0)) / (1.0 + light), c.a);
    }
}
