#pragma once
/// VANTAGE_VECTOR_CLONES before a function compiles it twice, for AVX2 and for any x86-64, and picks at load time. Both
/// give the same bits: contraction to fused multiply-add is off and the rest is integer or element-wise. Not under
/// sanitizers, whose runtimes are not up yet when the choice is made.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define VANTAGE_VECTOR_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define VANTAGE_VECTOR_CLONES
#endif
