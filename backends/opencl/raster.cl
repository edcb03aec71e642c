// Triangles into tiles, tiles into pixels; docs/rasterization.md has the rules by number.
//
// The host defines PG_TILE and PG_INTS before this text.  What draws differ in comes as arguments, so that compilers,
// which take half a second here, meet one text: ``screen`` (width and height in pixels, tiles across and
// down), ``cull`` (0 none, 1 back, 2 front), ``offset`` (factor and units of rule 5) and the number of ``varyings``.

// A triangle in slot t: six window coordinates in 1/256 pixel, wound so that its area is positive;
// the box of pixels that it can touch (x, X, y, Y; empty where x > X); whether it faces front: PG_INTS in all.
// Three depths, three 1/w relative to the largest, 1/area, polygon offset; then each varying's three values.
#define PG_PLACED 8

// Varyings that go through clipping together.
#define PG_TOGETHER 4
#define PG_CORNER (4 + PG_TOGETHER)
// A triangle cut by six planes has at most nine corners.
#define PG_CORNERS 9
// No corner is drawn farther than this many half-screens from the centre: twice the guard band.
#define PG_FARTHEST 16.0f
// pg_outside's bit of a point that is not finite; below it, one for each plane.
#define PG_NOT_FINITE 64

typedef struct { float v[PG_CORNER]; } pg_corner;

// Distance inside a plane of rule 1.  The sign of a float sum is exact, so this is z >= -w and so on.
float pg_distance(const float* p, int plane)
{
    float x = p[0], y = p[1], z = p[2], w = p[3];
    if (plane == 0) { return z + w; }
    if (plane == 1) { return w - z; }
    if (plane == 2) { return 8.0f * w - x; }
    if (plane == 3) { return 8.0f * w + x; }
    return plane == 4 ? 8.0f * w - y : 8.0f * w + y;
}

// One bit for each plane that a point lies outside of.
int pg_outside(float4 p)
{
    float v[4] = {p.x, p.y, p.z, p.w};
    int code = 0;
    for (int plane = 0; plane < 6; ++plane) { code |= pg_distance(v, plane) >= 0.0f ? 0 : 1 << plane; }
    for (int k = 0; k < 4; ++k) { code |= pg_isnan(v[k]) || pg_isinf(v[k]) ? PG_NOT_FINITE : 0; }
    return code;
}

// How many slots a triangle gets: seven where it is clipped, as six planes can make a nonagon of it.
int pg_slots(int a, int b, int c)
{
    if ((a & b & c) != 0 || ((a | b | c) & PG_NOT_FINITE) != 0) { return 0; }
    return (a | b | c) == 0 ? 1 : 7;
}

// Bits of the corners inside a plane that lie next to one another round the one that lies deepest.  Of a convex
// polygon these are all; where rounding puts others inside, counting them would cut more than two edges.
int pg_run(const pg_corner* in, int count, int plane)
{
    int deepest = 0;
    float most = pg_distance(in[0].v, plane);
    for (int i = 1; i < count; ++i) {
        float d = pg_distance(in[i].v, plane);
        if (d > most) { deepest = i; most = d; }
    }
    if (!(most >= 0.0f)) { return 0; }
    int run = 1 << deepest;
    for (int back = 0; back < 2; ++back) {
        int way = back ? count - 1 : 1;
        for (int i = (deepest + way) % count; i != deepest; i = (i + way) % count) {
            if (!(pg_distance(in[i].v, plane) >= 0.0f)) { break; }
            run |= 1 << i;
        }
    }
    return run;
}

// The corners of ``run`` and those where its two ends cross the plane: one more than there were at most.
int pg_clip(const pg_corner* in, int count, pg_corner* out, int plane, int run)
{
    int made = 0;
    for (int i = 0; i < count; ++i) {
        int next = i + 1 < count ? i + 1 : 0;
        bool here = run >> i & 1, there = run >> next & 1;
        if (here && made < PG_CORNERS) { out[made++] = in[i]; }
        if (here != there && made < PG_CORNERS) {
            // From the inside vertex, so that both triangles at a shared edge get the same point; each end by its
            // share, so that a huge one does not drown the other.
            int from = here ? i : next, to = here ? next : i;
            float d = pg_distance(in[from].v, plane), e = pg_distance(in[to].v, plane);
            float share = -e / (d - e), rest = d / (d - e);
            for (int k = 0; k < PG_CORNER; ++k) { out[made].v[k] = in[from].v[k] * share + in[to].v[k] * rest; }
            ++made;
        }
    }
    return made;
}

// A power of two times all three positions, which changes no place on the screen: distances and their differences
// stay far from the largest float.
void pg_scale(pg_corner* corners)
{
    float largest = 0.0f;
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 4; ++k) { largest = fmax(largest, fabs(corners[i].v[k])); }
    }
    int exponent = 60 - (max((int)(as_uint(largest) >> 23), 1) - 127);
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 4; ++k) { corners[i].v[k] = ldexp(corners[i].v[k], exponent); }
    }
}

// Rule 5: units are steps of a float depth at the triangle's largest depth.
float pg_depth_offset(float3 z, int2 a, int2 b, int2 c, float inverse_area, float2 offset)
{
    if (offset.x == 0.0f && offset.y == 0.0f) { return 0.0f; }
    float2 u = convert_float2(b - a), v = convert_float2(c - a);
    float du = z.y - z.x, dv = z.z - z.x;
    float slope_x = fabs(du * v.y - dv * u.y), slope_y = fabs(dv * u.x - du * v.x);
    // Coordinates are in 1/256 pixel and the area in 1/65536.
    float slope = (slope_x < slope_y ? slope_y : slope_x) * inverse_area * 256.0f;
    float largest = fmax(fmax(z.x, z.y), z.z);
    int exponent = max((int)((as_uint(largest) >> 23) & 255u), 1) - 127;
    return offset.x * slope + offset.y * ldexp(1.0f, exponent - 23);
}

// Rules 2, 3 and 5 for one triangle without parts outside.
void pg_emit(
    const float* a, const float* b, const float* c, int4 screen, int cull, float2 offset, __global int* ints,
    __global float* floats)
{
    const float* corner[3] = {a, b, c};
    float x[3], y[3];
    ints[6] = 1;
    ints[7] = 0;
    ints[8] = 1;
    ints[9] = 0;
    for (int i = 0; i < 3; ++i) {
        float w = corner[i][3], right = corner[i][0] / w, up = corner[i][1] / w;
        // A corner at the eye has no place on the screen, nor has one that rounding alone put far off.
        if (!(w > 0.0f && fabs(right) <= PG_FARTHEST && fabs(up) <= PG_FARTHEST)) { return; }
        x[i] = rint((right * 0.5f + 0.5f) * screen.x * 256.0f);
        y[i] = rint((0.5f - up * 0.5f) * screen.y * 256.0f);
    }
    int2 p = (int2)((int)x[0], (int)y[0]), q = (int2)((int)x[1], (int)y[1]), r = (int2)((int)x[2], (int)y[2]);
    long area = (long)(q.x - p.x) * (r.y - p.y) - (long)(q.y - p.y) * (r.x - p.x);
    if (area == 0) { return; }
    // y runs down here: counter-clockwise with y up is negative.
    int front = area < 0 ? 1 : 0;
    if (cull == 1 + front) { return; }
    // Pixels whose centre lies in the box: 256 * i + 128 between the smallest and the largest coordinate.
    int2 low = max((min(min(p, q), r) + 127) >> 8, (int2)(0, 0));
    int2 high = min((max(max(p, q), r) - 128) >> 8, screen.xy - 1);
    if (low.x > high.x || low.y > high.y) { return; }
    if (front) {
        int2 s = q;
        q = r;
        r = s;
        corner[1] = c;
        corner[2] = b;
        area = -area;
    }
    ints[0] = p.x;
    ints[1] = p.y;
    ints[2] = q.x;
    ints[3] = q.y;
    ints[4] = r.x;
    ints[5] = r.y;
    ints[6] = low.x;
    ints[7] = high.x;
    ints[8] = low.y;
    ints[9] = high.y;
    ints[10] = front;
    float depth[3], nearest = fmin(fmin(a[3], b[3]), c[3]);
    for (int i = 0; i < 3; ++i) {
        float w = corner[i][3];
        depth[i] = corner[i][2] / w * 0.5f + 0.5f;
        floats[i] = depth[i];
        floats[3 + i] = nearest / w;
    }
    floats[6] = 1.0f / (float)area;
    floats[7] = pg_depth_offset((float3)(depth[0], depth[1], depth[2]), p, q, r, floats[6], offset);
}

// A varying's values at three corners, in the order in which pg_emit wound them.
void pg_send(float a, float b, float c, int front, __global float* into)
{
    into[0] = a;
    into[1] = front ? c : b;
    into[2] = front ? b : c;
}

// A vertex with ``count`` of its varyings.
pg_corner pg_fetch(__global const float* clip, __global const float* varying, int count)
{
    pg_corner made;
    for (int k = 0; k < 4; ++k) { made.v[k] = clip[k]; }
    for (int k = 0; k < PG_TOGETHER; ++k) { made.v[4 + k] = k < count ? varying[k] : 0.0f; }
    return made;
}

// A triangle that some plane cuts, into its seven slots: the same corners for each few of its varyings.
void pg_emit_clipped(
    __global const float* clip, __global const float* sent, __global const int* index, int4 screen, int cull,
    float2 offset, int varyings, __global int* ints, __global float* floats)
{
    int floats_each = PG_PLACED + 3 * varyings;
    for (int done = 0; done == 0 || done < varyings; done += PG_TOGETHER) {
        int together = min(PG_TOGETHER, varyings - done);
        pg_corner first[PG_CORNERS], second[PG_CORNERS];
        for (int i = 0; i < 3; ++i) {
            first[i] = pg_fetch(clip + 4 * index[i], sent + varyings * index[i] + done, together);
        }
        pg_scale(first);
        int count = 3;
        for (int plane = 0; plane < 6 && count > 0; ++plane) {
            int run = pg_run(first, count, plane);
            if (run == (1 << count) - 1) { continue; }
            count = run == 0 ? 0 : pg_clip(first, count, second, plane, run);
            for (int i = 0; i < count; ++i) { first[i] = second[i]; }
        }
        for (int i = 0; i < PG_CORNERS - 2; ++i) {
            const float *a = first[0].v, *b = first[i + 1].v, *c = first[i + 2].v;
            __global int* to = ints + i * PG_INTS;
            __global float* values = floats + i * floats_each;
            if (done == 0) {
                to[6] = 1;
                to[7] = 0;
                if (i + 2 < count) { pg_emit(a, b, c, screen, cull, offset, to, values); }
            }
            for (int k = 0; k < together && to[6] <= to[7]; ++k) {
                pg_send(a[4 + k], b[4 + k], c[4 + k], to[10], values + PG_PLACED + 3 * (done + k));
            }
        }
    }
}

// Whether a triangle may cover a centre in a tile: for each edge, the corner of the tile that lies deepest inside.
bool pg_touches(__global const int* ints, int tile_x, int tile_y)
{
    int2 low = max((int2)(ints[6], ints[8]), (int2)(tile_x, tile_y) * PG_TILE) * 256 + 128;
    int2 high = min((int2)(ints[7], ints[9]), (int2)(tile_x, tile_y) * PG_TILE + (PG_TILE - 1)) * 256 + 128;
    for (int i = 0; i < 3; ++i) {
        int j = i < 2 ? i + 1 : 0;
        int2 a = (int2)(ints[2 * i], ints[2 * i + 1]), d = (int2)(ints[2 * j], ints[2 * j + 1]) - a;
        int x = d.y > 0 ? low.x : high.x, y = d.x > 0 ? high.y : low.y;
        if ((long)d.x * (y - a.y) - (long)d.y * (x - a.x) < 0) { return false; }
    }
    return true;
}

// Slots that a chunk of triangles needs.
__kernel void pg_count(
    __global const float* restrict clip, __global const int* restrict triangles, int first, int count, int chunk,
    int chunks, __global int* restrict slots)
{
    int id = (int)get_global_id(0);
    if (id >= chunks) { return; }
    int needed = 0;
    int end = min(count, (id + 1) * chunk);
    for (int t = id * chunk; t < end; ++t) {
        __global const int* corner = triangles + 3 * (first + t);
        int a = pg_outside(vload4(corner[0], clip)), b = pg_outside(vload4(corner[1], clip));
        needed += pg_slots(a, b, pg_outside(vload4(corner[2], clip)));
    }
    slots[id] = needed;
}

// A chunk's triangles into their slots, and how many of them fall into each tile.
__kernel void pg_setup(
    __global const float* restrict clip, __global const float* restrict sent, __global const int* restrict triangles,
    int first, int count, int chunk, int chunks, __global const int* restrict starts, __global int* restrict ints,
    __global float* restrict floats, __global int* restrict bins, int4 screen, int cull, float2 offset, int varyings)
{
    int id = (int)get_global_id(0);
    if (id >= chunks) { return; }
    int tiles = screen.z * screen.w;
    __global int* bin = bins + (long)id * tiles;
    for (int i = 0; i < tiles; ++i) { bin[i] = 0; }
    int slot = starts[id];
    int end = min(count, (id + 1) * chunk);
    for (int t = id * chunk; t < end; ++t) {
        __global const int* index = triangles + 3 * (first + t);
        int a = pg_outside(vload4(index[0], clip)), b = pg_outside(vload4(index[1], clip));
        int c = pg_outside(vload4(index[2], clip));
        int made = pg_slots(a, b, c);
        if (made == 0) { continue; }
        __global int* into = ints + (long)slot * PG_INTS;
        __global float* values = floats + (long)slot * (PG_PLACED + 3 * varyings);
        if (made == 1) {
            pg_corner p = pg_fetch(clip + 4 * index[0], sent, 0), q = pg_fetch(clip + 4 * index[1], sent, 0);
            pg_corner r = pg_fetch(clip + 4 * index[2], sent, 0);
            pg_emit(p.v, q.v, r.v, screen, cull, offset, into, values);
            __global const float *at_p = sent + varyings * index[0], *at_q = sent + varyings * index[1];
            __global const float* at_r = sent + varyings * index[2];
            for (int k = 0; k < varyings && into[6] <= into[7]; ++k) {
                pg_send(at_p[k], at_q[k], at_r[k], into[10], values + PG_PLACED + 3 * k);
            }
        } else {
            pg_emit_clipped(clip, sent, index, screen, cull, offset, varyings, into, values);
        }
        for (int k = 0; k < made; ++k, into += PG_INTS) {
            if (into[6] > into[7]) { continue; }
            int x = into[6] / PG_TILE, far_x = into[7] / PG_TILE, y = into[8] / PG_TILE, far_y = into[9] / PG_TILE;
            for (int v = y; v <= far_y; ++v) {
                for (int u = x; u <= far_x; ++u) { bin[v * screen.z + u] += pg_touches(into, u, v) ? 1 : 0; }
            }
        }
        slot += made;
    }
}

// For each tile: counts of the chunks become where each chunk begins in the tile's list; and the list's length.
__kernel void pg_scan(__global int* restrict bins, int chunks, __global int* restrict totals, int tiles)
{
    int tile = (int)get_global_id(0);
    if (tile >= tiles) { return; }
    int total = 0;
    for (int id = 0; id < chunks; ++id) {
        __global int* bin = bins + (long)id * tiles + tile;
        int here = *bin;
        *bin = total;
        total += here;
    }
    totals[tile] = total;
}

// Slots of a chunk into the lists of the tiles, in order of submission.
__kernel void pg_fill(
    __global const int* restrict starts, int chunks, __global const int* restrict ints, __global int* restrict bins,
    __global const int* restrict tile_starts, __global int* restrict list, int4 screen)
{
    int id = (int)get_global_id(0);
    if (id >= chunks) { return; }
    __global int* bin = bins + (long)id * screen.z * screen.w;
    for (int slot = starts[id]; slot < starts[id + 1]; ++slot) {
        __global const int* from = ints + (long)slot * PG_INTS;
        if (from[6] > from[7]) { continue; }
        int x = from[6] / PG_TILE, far_x = from[7] / PG_TILE, y = from[8] / PG_TILE, far_y = from[9] / PG_TILE;
        for (int v = y; v <= far_y; ++v) {
            for (int u = x; u <= far_x; ++u) {
                int tile = v * screen.z + u;
                if (pg_touches(from, u, v)) { list[tile_starts[tile] + bin[tile]++] = slot; }
            }
        }
    }
}
