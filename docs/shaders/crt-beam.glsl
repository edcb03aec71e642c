// Neighbours along a line run into each other, as the beam moves.
#pragma parameter BEAM "Softness of the beam" 0.5 0.0 1.0 0.05

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
uniform vec2 TextureSize;
uniform float BEAM;
void main() {
    vec2 step_x = vec2(1.0 / TextureSize.x, 0.0);
    vec3 c = texture(Texture, at).rgb;
    vec3 sides = 0.5 * (texture(Texture, at - step_x).rgb + texture(Texture, at + step_x).rgb);
    FragColor = vec4(mix(c, sides, 0.6 * BEAM), 1.0);
}
#endif
