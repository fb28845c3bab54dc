#pragma once

// The hot loops of SIFT are written on eight floats at a time, the sums of whole planes (sift_sums.h) on as
// many as the processor takes.
namespace mono_pose_tracker {

using Floats8 = float __attribute__((vector_size(32)));
using Ints8 = int __attribute__((vector_size(32)));
// The attributes are the name's: where they stand beside the type clang ignores them, and aligned moves
// crash.
using UnalignedFloats8 __attribute__((aligned(4), may_alias)) = Floats8;
static_assert(alignof(UnalignedFloats8) == 4, "rows begin anywhere");

#define MPT_SIFT_LOAD(pointer) (*reinterpret_cast<const UnalignedFloats8*>(pointer))
#define MPT_SIFT_STORE(pointer, value) (*reinterpret_cast<UnalignedFloats8*>(pointer) = (value))

using Floats4 = float __attribute__((vector_size(16)));
using UnalignedFloats4 __attribute__((aligned(4), may_alias)) = Floats4;

using Floats16 = float __attribute__((vector_size(64)));
using UnalignedFloats16 __attribute__((aligned(4), may_alias)) = Floats16;

}  // namespace mono_pose_tracker
