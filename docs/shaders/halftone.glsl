#version 330
// Four inks as dots on screens that are turned against each other, as in print.
uniform sampler2D image;
uniform float spacing = 6.0; // pixels from dot to dot
in vec2 uv;
out vec4 color;

vec4 inks(vec2 place) {
    vec3 c = 1.0 - texture(image, place).rgb;
    float black = min(c.r, min(c.g, c.b));
    black *= black;
    return vec4(c - black, black);
}

// How much of this pixel a dot of the screen covers, of the inks in the middle of the dot.
vec4 covered(vec2 turn) {
    mat2 screen = mat2(turn.x, turn.y, -turn.y, turn.x);
    vec2 middle = (floor(screen * gl_FragCoord.xy / spacing) + 0.5) * spacing * screen;
    float away = distance(gl_FragCoord.xy, middle) / spacing;
    vec4 amount = inks(middle / vec2(textureSize(image, 0)));
    vec4 radius = sqrt(amount) * (0.54 + 0.17 * amount);
    return clamp((radius - away) * spacing + 0.5, 0.0, 1.0);
}

void main() {
    vec3 paper = vec3(0.98, 0.97, 0.93);
    paper *= mix(vec3(1.0), vec3(0.0, 0.62, 0.88), covered(vec2(0.966, 0.259)).r);
    paper *= mix(vec3(1.0), vec3(0.9, 0.08, 0.5), covered(vec2(0.259, 0.966)).g);
    paper *= mix(vec3(1.0), vec3(1.0, 0.92, 0.05), covered(vec2(1.0, 0.0)).b);
    paper *= mix(vec3(1.0), vec3(0.12), covered(vec2(0.707, 0.707)).a);
    color = vec4(paper, texture(image, uv).a);
}
