// What our kernels call of OpenCL C: declared here where a compiler need not read all of it (programs.py).  Each function
// has the types that the language gives it, as far as ours could call it with them, so that calls mean the same.
#define PG_VALUE __attribute__((overloadable, const))

size_t PG_VALUE get_global_id(uint);
size_t PG_VALUE get_local_id(uint);
size_t PG_VALUE get_group_id(uint);
void __attribute__((overloadable, convergent)) barrier(cl_mem_fence_flags);
int __attribute__((overloadable)) atomic_inc(volatile __local int*);
uint __attribute__((overloadable)) atomic_inc(volatile __local uint*);
float4 __attribute__((overloadable, pure)) vload4(size_t, const __global float*);

// The compiler's own, one instruction each where the processor has it.  With those of PoCL's library (3.1) the passes of
// the shipped scene take a quarter longer.
#undef fabs
#define fabs(x) __builtin_fabsf(x)
#undef floor
#define floor(x) __builtin_floorf(x)
#undef ceil
#define ceil(x) __builtin_ceilf(x)
#undef trunc
#define trunc(x) __builtin_truncf(x)
#undef rint
#define rint(x) __builtin_rintf(x)
#undef sqrt
#define sqrt(x) __builtin_sqrtf(x)
float PG_VALUE fma(float, float, float);
float PG_VALUE fmin(float, float);
float PG_VALUE fmax(float, float);
float PG_VALUE ldexp(float, int);
float PG_VALUE rsqrt(float);
float PG_VALUE exp(float);
float PG_VALUE exp2(float);
float PG_VALUE log(float);
float PG_VALUE log2(float);
float PG_VALUE pow(float, float);
float PG_VALUE sin(float);
float PG_VALUE cos(float);
float PG_VALUE tan(float);
float PG_VALUE asin(float);
float PG_VALUE acos(float);
float PG_VALUE atan(float);
float PG_VALUE atan2(float, float);
float PG_VALUE sinh(float);
float PG_VALUE cosh(float);
float PG_VALUE tanh(float);
float PG_VALUE asinh(float);
float PG_VALUE acosh(float);
float PG_VALUE atanh(float);
float2 PG_VALUE convert_float2(int2);
uchar PG_VALUE convert_uchar_sat_rte(float);
ushort PG_VALUE convert_ushort_sat_rte(float);

#define PG_ORDER(type) \
    type PG_VALUE min(type, type); \
    type PG_VALUE max(type, type); \
    type PG_VALUE clamp(type, type, type);
PG_ORDER(float)
PG_ORDER(int)
PG_ORDER(uint)
PG_ORDER(long)
PG_ORDER(ulong)
PG_ORDER(int2)
