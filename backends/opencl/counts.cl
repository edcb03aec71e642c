// Bins of rows, counted (passgraph.plan.known).  Before it stand the arguments of a pixel pass (ARGUMENTS) and what is
// known of the pictures: WIDTH and HEIGHT of what is counted, NUMBER(x, y) one of its numbers as a float, QUARTER bins in
// a row of each output, COUNT(k, x, y) the place in out##k of bin x of row y.

#define BINS (4 * QUARTER)

// The entry of a number's bin; 0 for what is in none.
int pg_bin(float number)
{
    bool inside = number >= 1.0f && number <= (float)BINS;
    int near = (int)(inside ? number : 0.0f);
    return (float)near == number ? near : 0;
}

#if ITEMS == 1

// Entries side by side are often equal: added in several tables by turns, none waits for the one before.
#define TABLES 4
// Numbers that become entries together, in a loop that compilers turn into vectors.
#define PIECE 128
#define SUM(i) (float)(tables[0][i] + tables[1][i] + tables[2][i] + tables[3][i])
#define WRITE(k) for (int i = 0; i < QUARTER; ++i) { out##k[COUNT(k, i, y)] = SUM(k * QUARTER + i + 1); }

// One work-item a row.
__kernel void pg_counts(ARGUMENTS)
{
    int y = (int)get_global_id(0);
    uint tables[TABLES][BINS + 1];
    ushort entries[PIECE];
    for (int i = 0; i <= BINS; ++i) { tables[0][i] = tables[1][i] = tables[2][i] = tables[3][i] = 0; }
    for (int x = 0; x < WIDTH && y < HEIGHT; x += PIECE) {
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
    WRITE(0) WRITE(1) WRITE(2) WRITE(3)
}

#else

#define WRITE(k) for (int i = me; i < QUARTER; i += ITEMS) { out##k[COUNT(k, i, y)] = (float)table[k * QUARTER + i + 1]; }

// One group a row; its table lies in the group's own memory.
__kernel __attribute__((reqd_work_group_size(ITEMS, 1, 1))) void pg_counts(ARGUMENTS)
{
    __local uint table[BINS + 1];
    int me = (int)get_local_id(0), y = (int)get_group_id(0);
    for (int i = me; i <= BINS; i += ITEMS) { table[i] = 0; }
    barrier(CLK_LOCAL_MEM_FENCE);
    for (int x = me; x < WIDTH && y < HEIGHT; x += ITEMS) {
        int entry = pg_bin(NUMBER(x, y));
        if (entry > 0) { atomic_inc(&table[entry]); }
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    WRITE(0) WRITE(1) WRITE(2) WRITE(3)
}

#endif
