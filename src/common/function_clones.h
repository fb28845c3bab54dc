#pragma once

// Before a function: it is compiled twice, for any processor and for those with AVX2 and FMA (or with what is
// named); the loader takes the one that runs. Floating-point results repeat on one machine, not to the last
// bit between machines that differ in that.
//
// The choice is made while the loader still relocates: a sanitizer's own code, called from there, jumps
// through addresses that are not filled in yet and crashes. Those builds get the plain code, as do clang's,
// whose libFuzzer builds are always with a sanitizer.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__) && \
    !defined(__SANITIZE_ADDRESS__)
#define MPT_FUNCTION_CLONES_FOR(...) __attribute__((target_clones(__VA_ARGS__, "default")))
#else
#define MPT_FUNCTION_CLONES_FOR(...)
#endif

#if __GNUC__ >= 12
#define MPT_FUNCTION_CLONES MPT_FUNCTION_CLONES_FOR("arch=x86-64-v3")
#else
#define MPT_FUNCTION_CLONES MPT_FUNCTION_CLONES_FOR("avx2")
#endif
