#pragma once

// The hot loops of SIFT are written once, on eight floats at a time, and compiled twice: for any processor
// and for those with AVX2 and FMA; the loader takes the one that runs. Results repeat on one machine, not to
// the last bit between machines that differ in that. Sanitizers cannot be loaded that way and get the plain
// code.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__) && \
    !defined(__SANITIZE_ADDRESS__)
#if __GNUC__ >= 12
#define MPT_SIFT_CLONES __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define MPT_SIFT_CLONES __attribute__((target_clones("avx2", "default")))
#endif
#else
#define MPT_SIFT_CLONES
#endif

namespace mono_pose_tracker {

using Floats8 = float __attribute__((vector_size(32)));
using Ints8 = int __attribute__((vector_size(32)));
using UnalignedFloats8 = float __attribute__((vector_size(32), aligned(4), may_alias));

#define MPT_SIFT_LOAD(pointer) (*reinterpret_cast<const UnalignedFloats8*>(pointer))
#define MPT_SIFT_STORE(pointer, value) (*reinterpret_cast<UnalignedFloats8*>(pointer) = (value))

}  // namespace mono_pose_tracker
