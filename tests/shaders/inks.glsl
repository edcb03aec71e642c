// A picture in three inks, each printed as marks on a screen that is turned: for each ink the four marks around a pixel,
// each as large as the mean of nine texels says, of one of five shapes, put over the picture in one of five ways.
// What it computes again and again (powers, sines, angles) is written once and called from many places, as shaders do.
#define TURN 6.28318531

uniform sampler2D picture;
uniform float pitch, angle_r, angle_g, angle_b, jitter, share;
uniform vec2 extent;
uniform int mark, manner;
uniform bool grey, plain;
varying vec2 at;

const int ring = 8;

struct Screen {
    vec2 along;
    vec2 first;
    vec2 second;
    vec2 third;
    vec2 fourth;
};

float size_of(vec2 v) {
    return sqrt(v.x * v.x + v.y * v.y);
}

float noise(vec2 seed) {
    return fract(sin(dot(seed, vec2(27.1687, 61.4142))) * 4321.75);
}

// How far inside of a mark a place lies, in pixels.
float inside(float tone, vec2 mark_at, vec2 along, vec2 place, float angle) {
    vec2 away = mark_at - place;
    float far = size_of(away);
    float reach = tone;
    if (mark == 1) {
        reach = pow(abs(tone), 1.125) * pitch;
    } else if (mark == 2) {
        reach = pow(abs(tone), 1.125) * pitch;
        if (far != 0.0) {
            float slant = abs(away.x / far * along.x + away.y / far * along.y);
            far = far * 0.75 + slant * far * 0.5;
        }
    } else if (mark == 3) {
        reach = pow(abs(tone), 1.5) * pitch;
        float across = away.x * along.x + away.y * along.y;
        far = size_of(along * across);
    } else if (mark == 4) {
        float turned = atan(away.y, away.x) - angle;
        float s = abs(sin(turned));
        float c = abs(cos(turned));
        reach = pow(abs(tone), 1.375);
        reach = pitch * (reach + (s > c ? reach - s * reach : reach - c * reach));
    } else if (mark == 5) {
        float turned = atan(away.y, away.x) - angle - TURN / 8.0;
        float s = abs(sin(turned));
        float c = abs(cos(turned));
        reach = pow(abs(tone), 1.375);
        reach = pitch * (reach + (s > c ? reach - s * reach : reach - c * reach));
    }
    return reach - far;
}

// The mean of a texel and of those on a ring around it.
vec4 mean(vec2 place) {
    vec4 total = texture2D(picture, place / extent);
    float start = noise(floor(place)) * TURN;
    for (int i = 0; i < ring; ++i) {
        float turn = start + TURN / float(ring) * float(i);
        total += texture2D(picture, (place + vec2(cos(turn), sin(turn)) * (pitch * 0.625)) / extent);
    }
    return total / (float(ring) + 1.0);
}

float ink(Screen screen, vec2 place, int channel, float angle, float edge) {
    float a, b, c, d;
    if (channel == 0) {
        a = mean(screen.first).r;
        b = mean(screen.second).r;
        c = mean(screen.third).r;
        d = mean(screen.fourth).r;
    } else if (channel == 1) {
        a = mean(screen.first).g;
        b = mean(screen.second).g;
        c = mean(screen.third).g;
        d = mean(screen.fourth).g;
    } else {
        a = mean(screen.first).b;
        b = mean(screen.second).b;
        c = mean(screen.third).b;
        d = mean(screen.fourth).b;
    }
    a = inside(a, screen.first, screen.along, place, angle);
    b = inside(b, screen.second, screen.along, place, angle);
    c = inside(c, screen.third, screen.along, place, angle);
    d = inside(d, screen.fourth, screen.along, place, angle);
    float covered = a > 0.0 ? clamp(a / edge, 0.0, 1.0) : 0.0;
    covered += b > 0.0 ? clamp(b / edge, 0.0, 1.0) : 0.0;
    covered += c > 0.0 ? clamp(c / edge, 0.0, 1.0) : 0.0;
    covered += d > 0.0 ? clamp(d / edge, 0.0, 1.0) : 0.0;
    return clamp(covered, 0.0, 1.0);
}

// The marks around a place: the nearest crossing of the screen's lines, and three toward the place.
Screen screen_at(vec2 place, float angle) {
    Screen screen;
    vec2 n = vec2(cos(angle), sin(angle));
    float u = n.x * place.x + n.y * place.y;
    float v = n.x * place.y - n.y * place.x;
    vec2 foot = n * u;
    float rest_u = mod(size_of(foot), pitch);
    float rest_v = mod(size_of(place - foot), pitch);
    float sign_u = u < 0.0 ? 1.0 : -1.0;
    float sign_v = v < 0.0 ? 1.0 : -1.0;
    float back_u = (rest_u < pitch * 0.5 ? -rest_u : pitch - rest_u) * sign_u;
    float back_v = (rest_v < pitch * 0.5 ? -rest_v : pitch - rest_v) * sign_v;
    screen.along = n;
    screen.first.x = place.x - n.x * back_u + n.y * back_v;
    screen.first.y = place.y - n.y * back_u - n.x * back_v;
    if (jitter != 0.0) {
        float turn = noise(floor(screen.first)) * TURN;
        screen.first.x += cos(turn) * jitter * pitch * 0.25;
        screen.first.y += sin(turn) * jitter * pitch * 0.25;
    }
    float step_u = sign_u * (rest_u < pitch * 0.5 ? pitch : -pitch);
    float step_v = sign_v * (rest_v < pitch * 0.5 ? pitch : -pitch);
    screen.second = screen.first - n * step_u;
    screen.third = screen.first + vec2(n.y, -n.x) * step_v;
    screen.fourth = screen.second + vec2(n.y, -n.x) * step_v;
    return screen;
}

float between(float a, float b, float t) {
    return a * (1.0 - t) + b * t;
}

float put_over(float a, float b) {
    if (manner == 1) {
        return between(a, b, 1.0 - share);
    } else if (manner == 2) {
        return between(a, max(0.0, a * b), share);
    } else if (manner == 3) {
        return between(a, min(1.0, a + b), share);
    } else if (manner == 4) {
        return between(a, max(a, b), share);
    } else if (manner == 5) {
        return between(a, min(a, b), share);
    } else {
        return between(a, b, 1.0 - share);
    }
}

void main() {
    if (!plain) {
        vec2 place = at * extent;
        float edge = pitch < 2.5 ? pitch * 0.5 : 1.25;
        Screen screen_r = screen_at(place, angle_r);
        Screen screen_g = screen_at(place, angle_g);
        Screen screen_b = screen_at(place, angle_b);
        float r = ink(screen_r, place, 0, angle_r, edge);
        float g = ink(screen_g, place, 1, angle_g, edge);
        float b = ink(screen_b, place, 2, angle_b, edge);
        vec4 c = texture2D(picture, at);
        r = put_over(r, c.r);
        g = put_over(g, c.g);
        b = put_over(b, c.b);
        if (grey) {
            r = g = b = (r + g + b) / 3.0;
        }
        gl_FragColor = vec4(r, g, b, 1.0);
    } else {
        gl_FragColor = texture2D(picture, at);
    }
}
