// Rules 4 to 7: which pixels of a tile a triangle of raster.cl covers, and what happens there.
//
// The host defines, before this text: PG_WIDTH, PG_HEIGHT, PG_TILE, PG_TILES_X, PG_INTS, PG_FLOATS, PG_DEPTH,
// PG_READS_DEPTH, PG_BESIDE (bit k: whether the kernel reads at pixel k of the quad: 1 beside this one, 2 above or below,
// 3 across), PG_SERIAL, PG_RESOURCES and PG_PASS (parameters and arguments: images, targets, depth, stencil,
// uniforms), pg_clear_pixel() and pg_shade().

// An edge from a to b at a pixel centre, positive inside; less one where the edge is neither top nor left, so
// that covered means not negative.
long pg_edge(int2 a, int2 b, int x, int y)
{
    int2 d = b - a;
    long value = (long)d.x * (256 * y + 128 - a.y) - (long)d.y * (256 * x + 128 - a.x);
    return value - (d.y < 0 || (d.y == 0 && d.x > 0) ? 0 : 1);
}

// How much pg_edge was lowered.
long pg_lowered(int2 a, int2 b)
{
    int2 d = b - a;
    return d.y < 0 || (d.y == 0 && d.x > 0) ? 0 : 1;
}

// Shares of the second and the third corner in perspective, and the depth: each edge is a share of the corner opposite to
// it.
float3 pg_place(long e0, long e1, long e2, __global const float* tri)
{
#if PG_DEPTH || PG_READS_DEPTH
    float u = (float)e1 * tri[6], v = (float)e2 * tri[6];
    float depth = tri[0] + (tri[1] - tri[0]) * u + (tri[2] - tri[0]) * v + tri[7];
    depth = depth < 0.0f ? 0.0f : (1.0f < depth ? 1.0f : depth);
#else
    float depth = 0.0f;
#endif
    // In the triangle, a sum of what is not negative: it keeps all its digits, however near to the eye one corner is.
    float near0 = (float)e0 * tri[3], near1 = (float)e1 * tri[4], near2 = (float)e2 * tri[5];
    float total = near0 + near1 + near2;
    return (float3)(near1 / total, near2 / total, depth);
}

void pg_covered(
    int x, int y, long e0, long e1, long e2, __global const int* t, __global const float* tri, PG_RESOURCES)
{
    float3 there[4];
    there[0] = pg_place(e0, e1, e2, tri);
#if PG_BESIDE
    long right = (x & 1) != 0 ? -256L : 256L, down = (y & 1) != 0 ? -256L : 256L;
    for (int k = 1; k < 4; ++k) {
        if ((PG_BESIDE >> k & 1) != 0) {
            long dx = (k & 1) != 0 ? right : 0, dy = (k & 2) != 0 ? down : 0;
            there[k] = pg_place(
                e0 + dy * (t[4] - t[2]) - dx * (t[5] - t[3]), e1 + dy * (t[0] - t[4]) - dx * (t[1] - t[5]),
                e2 + dy * (t[2] - t[0]) - dx * (t[3] - t[1]), tri);
        }
    }
#endif
    pg_shade(x, y, there, t[10] != 0, tri, PG_PASS);
}

#if PG_SERIAL
// One work-item a tile, for CPUs: each triangle's own box of pixels.
__kernel void pg_tiles(
    __global const int* restrict ints, __global const float* restrict tri_floats, __global const int* restrict list,
    __global const int* restrict tile_starts, int clear, PG_KERNEL_RESOURCES)
{
    int tile = (int)get_global_id(0);
    int left = tile % PG_TILES_X * PG_TILE, top = tile / PG_TILES_X * PG_TILE;
    int right = min(left + PG_TILE, PG_WIDTH) - 1, bottom = min(top + PG_TILE, PG_HEIGHT) - 1;
    if (clear) {
        for (int y = top; y <= bottom; ++y) {
            for (int x = left; x <= right; ++x) { pg_clear_pixel(x, y, PG_PASS); }
        }
    }
    for (int i = tile_starts[tile]; i < tile_starts[tile + 1]; ++i) {
        __global const int* t = ints + (long)list[i] * PG_INTS;
        __global const float* tri = tri_floats + (long)list[i] * PG_FLOATS;
        int2 a = (int2)(t[0], t[1]), b = (int2)(t[2], t[3]), c = (int2)(t[4], t[5]);
        int x0 = max(left, t[6]), x1 = min(right, t[7]), y0 = max(top, t[8]), y1 = min(bottom, t[9]);
        long e0 = pg_edge(b, c, x0, y0), e1 = pg_edge(c, a, x0, y0), e2 = pg_edge(a, b, x0, y0);
        long low0 = pg_lowered(b, c), low1 = pg_lowered(c, a), low2 = pg_lowered(a, b);
        long dx0 = 256L * (c.y - b.y), dx1 = 256L * (a.y - c.y), dx2 = 256L * (b.y - a.y);
        long dy0 = 256L * (c.x - b.x), dy1 = 256L * (a.x - c.x), dy2 = 256L * (b.x - a.x);
        for (int y = y0; y <= y1; ++y, e0 += dy0, e1 += dy1, e2 += dy2) {
            long f0 = e0, f1 = e1, f2 = e2;
            for (int x = x0; x <= x1; ++x, f0 -= dx0, f1 -= dx1, f2 -= dx2) {
                if ((f0 | f1 | f2) >= 0) {
                    pg_covered(x, y, f0 + low0, f1 + low1, f2 + low2, t, tri, PG_PASS);
                }
            }
        }
    }
}
#else
// One work-item a pixel and a work-group a tile.
__kernel __attribute__((reqd_work_group_size(PG_TILE, PG_TILE, 1))) void pg_tiles(
    __global const int* restrict ints, __global const float* restrict tri_floats, __global const int* restrict list,
    __global const int* restrict tile_starts, int clear, PG_KERNEL_RESOURCES)
{
    int tile = (int)(get_group_id(1) * PG_TILES_X + get_group_id(0));
    int x = (int)get_global_id(0), y = (int)get_global_id(1);
    if (x >= PG_WIDTH || y >= PG_HEIGHT) { return; }
    if (clear) { pg_clear_pixel(x, y, PG_PASS); }
    for (int i = tile_starts[tile]; i < tile_starts[tile + 1]; ++i) {
        __global const int* t = ints + (long)list[i] * PG_INTS;
        if (x < t[6] || x > t[7] || y < t[8] || y > t[9]) { continue; }
        int2 a = (int2)(t[0], t[1]), b = (int2)(t[2], t[3]), c = (int2)(t[4], t[5]);
        long e0 = pg_edge(b, c, x, y), e1 = pg_edge(c, a, x, y), e2 = pg_edge(a, b, x, y);
        if ((e0 | e1 | e2) < 0) { continue; }
        __global const float* tri = tri_floats + (long)list[i] * PG_FLOATS;
        e0 += pg_lowered(b, c);
        pg_covered(x, y, e0, e1 + pg_lowered(c, a), e2 + pg_lowered(a, b), t, tri, PG_PASS);
    }
}
#endif
