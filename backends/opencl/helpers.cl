// Functions that printed kernels call.  Integer arithmetic wraps through uint: overflow of int is undefined in C.
#pragma OPENCL FP_CONTRACT OFF

// Rounded once where that is one instruction.
#if defined(FP_FAST_FMAF) || defined(__FMA__) || defined(__ARM_FEATURE_FMA)
#define pg_fma fma
#else
#define pg_fma(a, b, c) ((a) * (b) + (c))
#endif

int pg_add(int a, int b) { return as_int(as_uint(a) + as_uint(b)); }
int pg_sub(int a, int b) { return as_int(as_uint(a) - as_uint(b)); }
int pg_mul(int a, int b) { return as_int(as_uint(a) * as_uint(b)); }
int pg_shl(int a, int b) { return as_int(as_uint(a) << (as_uint(b) & 31u)); }
// Not the built-in: compilers take its result as never negative, also of the lowest int, and drop what tests for that.
int pg_abs(int a) { return max(a, pg_sub(0, a)); }

// By bits, so that no compiler assumes them away.
bool pg_isnan(float x) { return (as_uint(x) & 0x7FFFFFFFu) > 0x7F800000u; }
bool pg_isinf(float x) { return (as_uint(x) & 0x7FFFFFFFu) == 0x7F800000u; }

// Toward zero; saturates, and NaN gives 0.  2147483520 is the largest float32 that fits.
int pg_to_int(float x)
{
    int inside = (int)clamp(pg_isnan(x) ? 0.0f : x, -2147483648.0f, 2147483520.0f);
    return x >= 2147483648.0f ? 2147483647 : inside;
}

// binary16 by bits: vload_half and vstore_half are calls into a library on CPUs and do not vectorise.
float pg_load_half(ushort h)
{
    uint size = (uint)(h & 0x7FFF) << 13;
    // Halves' exponents are biased by 15, floats' by 127: scaling by 2**112 is exact, for denormals too.
    float finite = as_float(size) * 5192296858534827628530496329220096.0f;
    uint bits = size >= 0x0F800000u ? (size | 0x7F800000u) : as_uint(finite);
    return as_float(bits | ((uint)(h & 0x8000) << 16));
}

// To the nearest half, halves to even; 65520 and above become infinite.
ushort pg_store_half(float x)
{
    uint bits = as_uint(x);
    uint size = bits & 0x7FFFFFFFu;
    uint normal = ((size + 0xFFFu + ((size >> 13) & 1u)) >> 13) - (112u << 10);
    // Below 2**-14, halves are multiples of 2**-24; adding 0.5 leaves that multiple in the last bits.
    uint tiny = as_uint(as_float(size) + 0.5f) - 0x3F000000u;
    uint rounded = size < 0x38800000u ? tiny : normal;
    uint finite = size >= 0x477FF000u ? 0x7C00u : rounded;
    uint half_bits = size > 0x7F800000u ? 0x7E00u : finite;
    return (ushort)(half_bits | ((bits >> 16) & 0x8000u));
}
