// Bins, counted (passgraph.plan.known) in strips of rows.  Before it stand the arguments of a pixel pass and the tables of
// the strips (ARGUMENTS), and what is known: WIDTH and HEIGHT of what is counted, NUMBER(x, y) the number of a pixel,
// BINS; ROWS of a strip, EACH rows that are counted together, TOGETHER strips in these; ITEMS work-items of a group.

// The entry of a number's bin; 0 for what is in none.
int pg_bin(float number)
{
    bool inside = number >= 1.0f && number <= (float)BINS;
    int near = (int)(inside ? number : 0.0f);
    return (float)near == number ? near : 0;
}

// The row behind a strip's last one.
int pg_end(int together, int y) { return min(min(y + ROWS, (together + 1) * EACH), HEIGHT); }

#if ITEMS == 1

// Entries side by side are often equal: added in several tables by turns, none waits for the one before.
#define TABLES 4
// Numbers that become entries together, in a loop that compilers turn into vectors.
#define PIECE 128

// One work-item a strip.
__kernel void pg_counts(ARGUMENTS)
{
    int strip = (int)get_global_id(0), together = strip / TOGETHER;
    int y = together * EACH + strip % TOGETHER * ROWS, end = pg_end(together, y);
    uint tables[TABLES][BINS + 1];
    ushort entries[PIECE];
    for (int i = 0; i <= BINS; ++i) { tables[0][i] = tables[1][i] = tables[2][i] = tables[3][i] = 0; }
    for (; y < end; ++y) {
        for (int x = 0; x < WIDTH; x += PIECE) {
            int count = min(PIECE, WIDTH - x);
            for (int i = 0; i < count; ++i) { entries[i] = (ushort)pg_bin(NUMBER(x + i, y)); }
            for (int i = count; i < PIECE; ++i) { entries[i] = 0; }
            for (int i = 0; i < PIECE; i += TABLES) {
                tables[0][entries[i]] += 1;
                tables[1][entries[i + 1]] += 1;
                tables[2][entries[i + 2]] += 1;
                tables[3][entries[i + 3]] += 1;
            }
        }
    }
    for (int i = 0; i < BINS; ++i) {
        counts[strip * BINS + i] = tables[0][i + 1] + tables[1][i + 1] + tables[2][i + 1] + tables[3][i + 1];
    }
}

#else

// One group a strip; its table lies in the group's own memory.
__kernel __attribute__((reqd_work_group_size(ITEMS, 1, 1))) void pg_counts(ARGUMENTS)
{
    __local uint table[BINS + 1];
    int me = (int)get_local_id(0), strip = (int)get_group_id(0), together = strip / TOGETHER;
    int y = together * EACH + strip % TOGETHER * ROWS, end = pg_end(together, y);
    for (int i = me; i <= BINS; i += ITEMS) { table[i] = 0; }
    barrier(CLK_LOCAL_MEM_FENCE);
    for (; y < end; ++y) {
        for (int x = me; x < WIDTH; x += ITEMS) {
            int entry = pg_bin(NUMBER(x, y));
            if (entry > 0) { atomic_inc(&table[entry]); }
        }
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    for (int i = me; i < BINS; i += ITEMS) { counts[strip * BINS + i] = table[i + 1]; }
}

#endif

// What the strips of a row of the outputs have counted in a bin; rows below the picture have none.
float pg_sum(__global const uint* counts, int row, int bin)
{
    uint sum = 0;
    for (int i = 0; i < TOGETHER && row * EACH < HEIGHT; ++i) { sum += counts[(row * TOGETHER + i) * BINS + bin]; }
    return (float)sum;
}
