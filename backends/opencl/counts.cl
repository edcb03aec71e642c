// Bins of rows, counted (passgraph.plan.data.CountStep).  Before it stand the arguments of a pixel pass (ARGUMENTS), and what is
// known: WIDTH and HEIGHT of what is counted, NUMBER(x, y) the number of a pixel, BINS, COLUMNS of the output; ITEMS
// work-items of a group; STORE(x, y), which writes column x of row y of the output from SUM(entry).

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
#define SUM(entry) (float)(tables[0][entry] + tables[1][entry] + tables[2][entry] + tables[3][entry])

// One work-item a row; rows below the picture have none of any bin.
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
    for (int x = 0; x < COLUMNS; ++x) { STORE(x, y) }
}

#else

#define SUM(entry) (float)table[entry]

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
    for (int x = me; x < COLUMNS; x += ITEMS) { STORE(x, y) }
}

#endif
