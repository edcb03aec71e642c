//!PARAM radius
//!DESC Radius of the brush, texels
//!TYPE int
//!MINIMUM 1
//!MAXIMUM 8
4

//!HOOK MAIN
//!BIND HOOKED
//!DESC Kuwahara: of four squares around a pixel the mean of the most even one
vec4 hook() {
    vec4 best = vec4(0.0);
    float least = 1e9;
    for (int square = 0; square < 4; square++) {
        ivec2 side = ivec2(square & 1, square >> 1) * 2 - 1;
        vec3 sum = vec3(0.0), squares = vec3(0.0);
        for (int y = 0; y <= 8; y++)
            for (int x = 0; x <= 8; x++) {
                if (max(x, y) > radius) break;
                vec3 c = HOOKED_texOff(vec2(side * ivec2(x, y))).rgb;
                sum += c;
                squares += c * c;
            }
        float count = float((radius + 1) * (radius + 1));
        vec3 mean = sum / count;
        float spread = dot(squares / count - mean * mean, vec3(1.0));
        // Even squares are alike but for rounding; the first of them stays.
        if (spread < 0.98 * least - 1e-5) {
            least = spread;
            best = vec4(mean, 1.0);
        }
    }
    return best;
}
