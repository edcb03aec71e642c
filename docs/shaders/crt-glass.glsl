// Lines with dark between them, a mask of three colours, glass that bulges.
#pragma parameter BULGE "Bulge of the glass" 0.12 0.0 0.5 0.01
#pragma parameter LINES "Depth of the lines" 0.55 0.0 1.0 0.05
#pragma parameter MASK "Strength of the mask" 0.35 0.0 1.0 0.05

#if defined(VERTEX)
in vec4 VertexCoord, TexCoord;
out vec2 at;
uniform mat4 MVPMatrix;
void main() {
    gl_Position = MVPMatrix * VertexCoord;
    at = TexCoord.xy;
}
#elif defined(FRAGMENT)
in vec2 at;
out vec4 FragColor;
uniform sampler2D Texture;
uniform vec2 OutputSize, TextureSize;
uniform float BULGE, LINES, MASK;
void main() {
    vec2 p = 2.0 * at - 1.0;
    p *= 1.0 + BULGE * dot(p, p) * vec2(0.25, 0.35);
    vec2 place = 0.5 * p + 0.5;
    vec3 c = texture(Texture, place).rgb;
    float across = abs(fract(place.y * TextureSize.y) - 0.5) * 2.0;
    float bright = dot(c, vec3(0.3, 0.5, 0.2));
    c *= 1.0 - LINES * across * across * (1.0 - 0.5 * bright);
    int column = int(at.x * OutputSize.x) % 3;
    c *= mix(vec3(1.0), 1.4 * vec3(column == 0, column == 1, column == 2) + 0.55, MASK);
    vec2 edge = smoothstep(vec2(1.0), vec2(0.985), abs(p));
    FragColor = vec4(1.25 * c * edge.x * edge.y, 1.0);
}
#endif
