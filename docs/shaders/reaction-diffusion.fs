/*{
    "DESCRIPTION": "Gray and Scott's two chemicals, fed where the picture is bright; they go on from frame to frame",
    "CREDIT": "passgraph",
    "CATEGORIES": ["Stylize"],
    "ISFVSN": "2",
    "INPUTS": [
        {"NAME": "inputImage", "TYPE": "image"},
        {"NAME": "feed", "TYPE": "float", "MIN": 0.02, "MAX": 0.06, "DEFAULT": 0.037, "LABEL": "Feed"},
        {"NAME": "kill", "TYPE": "float", "MIN": 0.05, "MAX": 0.07, "DEFAULT": 0.06, "LABEL": "Kill"},
        {"NAME": "guided", "TYPE": "float", "MIN": 0, "MAX": 1, "DEFAULT": 0.5, "LABEL": "Guided by the picture"}
    ],
    "PASSES": [
        {"TARGET": "state", "PERSISTENT": true, "FLOAT": true},
        {}
    ]
}*/

vec2 near(float x, float y) {
    return IMG_NORM_PIXEL(state, isf_FragNormCoord + vec2(x, y) / RENDERSIZE).xy;
}

float luma(vec3 c) {
    return dot(c, vec3(0.2126, 0.7152, 0.0722));
}

void main() {
    vec3 picture = IMG_THIS_PIXEL(inputImage).rgb;
    vec2 s = near(0.0, 0.0);
    if (PASSINDEX == 0) {
        vec2 sides = near(1.0, 0.0) + near(-1.0, 0.0) + near(0.0, 1.0) + near(0.0, -1.0);
        vec2 corners = near(1.0, 1.0) + near(-1.0, 1.0) + near(1.0, -1.0) + near(-1.0, -1.0);
        float eaten = s.x * s.y * s.y;
        float f = feed + guided * 0.02 * (luma(picture) - 0.5);
        vec2 change = vec2(1.0, 0.5) * (0.2 * sides + 0.05 * corners - s);
        vec2 next = s + change + vec2(f * (1.0 - s.x) - eaten, eaten - (f + kill) * s.y);
        uvec2 cell = uvec2(gl_FragCoord.xy) / 6u;
        bool seeded = ((cell.x * 1597334677u ^ cell.y * 3812015801u) >> 9u) % 11u == 0u;
        gl_FragColor = vec4(FRAMEINDEX == 0 ? vec2(1.0, seeded ? 0.5 : 0.0) : next, 0.0, 1.0);
    } else {
        float ink = smoothstep(0.1, 0.3, s.y);
        vec3 paper = vec3(0.96, 0.93, 0.86);
        gl_FragColor = vec4(mix(paper, 0.75 * picture, ink), 1.0);
    }
}
