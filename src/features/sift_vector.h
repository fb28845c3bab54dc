#pragma once

// The hot loops of SIFT are written once, on eight floats at a time, or sixteen where whole planes are gone
// through.
namespace mono_pose_tracker {

using Floats8 = float __attribute__((vector_size(32)));
using Ints8 = int __attribute__((vector_size(32)));
// The attributes are the name's: where they stand beside the type clang ignores them, and aligned moves
// crash.
using UnalignedFloats8 __attribute__((aligned(4), may_alias)) = Floats8;
static_assert(alignof(UnalignedFloats8) == 4, "rows begin anywhere");

#define MPT_SIFT_LOAD(pointer) (*reinterpret_cast<const UnalignedFloats8*>(pointer))
#define MPT_SIFT_STORE(pointer, value) (*reinterpret_cast<UnalignedFloats8*>(pointer) = (value))

using Floats16 = float __attribute__((vector_size(64)));
using UnalignedFloats16 __attribute__((aligned(4), may_alias)) = Floats16;

#define MPT_SIFT_LOAD16(pointer) (*reinterpret_cast<const UnalignedFloats16*>(pointer))
#define MPT_SIFT_STORE16(pointer, value) (*reinterpret_cast<UnalignedFloats16*>(pointer) = (value))

}  // namespace mono_pose_tracker
