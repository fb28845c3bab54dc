#pragma once

#include <Eigen/Core>
#include <vector>

namespace mono_pose_tracker {

/// Packets of four numbers (SIMD), and vectors of three packets. Compilers turn loops over these into vector
/// instructions.
constexpr int kPacketSize = 4;
using Packet = Eigen::Array<double, kPacketSize, 1>;

/// Vectors whose errors are computed at once; scoring may give up between blocks.
constexpr int kBlockSize = 16;

struct PacketVector {
  Packet x, y, z;
};

inline PacketVector operator*(const Eigen::Matrix3d& m, const PacketVector& v) {
  return {m(0, 0) * v.x + m(0, 1) * v.y + m(0, 2) * v.z, m(1, 0) * v.x + m(1, 1) * v.y + m(1, 2) * v.z,
          m(2, 0) * v.x + m(2, 1) * v.y + m(2, 2) * v.z};
}

inline PacketVector operator+(const PacketVector& a, const Eigen::Vector3d& b) {
  return {a.x + b.x(), a.y + b.y(), a.z + b.z()};
}

inline PacketVector operator*(const Packet& a, const PacketVector& b) { return {a * b.x, a * b.y, a * b.z}; }

inline PacketVector& operator+=(PacketVector& a, const PacketVector& b) {
  a.x += b.x;
  a.y += b.y;
  a.z += b.z;
  return a;
}

inline PacketVector& operator-=(PacketVector& a, const PacketVector& b) {
  a.x -= b.x;
  a.y -= b.y;
  a.z -= b.z;
  return a;
}

inline Packet dot(const PacketVector& a, const PacketVector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

inline Packet dot(const Eigen::Vector3d& a, const PacketVector& b) {
  return a.x() * b.x + a.y() * b.y + a.z() * b.z;
}

inline PacketVector cross(const PacketVector& a, const PacketVector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

inline PacketVector cross(const PacketVector& a, const Eigen::Vector3d& b) {
  return {a.y * b.z() - a.z * b.y(), a.z * b.x() - a.x * b.z(), a.x * b.y() - a.y * b.x()};
}

inline Eigen::Vector3d sum(const PacketVector& a) { return {a.x.sum(), a.y.sum(), a.z.sum()}; }

/// Vectors stored coordinate by coordinate, padded with zeros to a multiple of kBlockSize.
class VectorArray {
 public:
  VectorArray() = default;

  explicit VectorArray(const std::vector<Eigen::Vector3d>& vectors)
      : size_(static_cast<int>(vectors.size())) {
    for (int axis = 0; axis < 3; ++axis) {
      coordinates_[axis].assign((vectors.size() + kBlockSize - 1) / kBlockSize * kBlockSize, 0.0);
      for (int i = 0; i < size_; ++i) {
        coordinates_[axis][i] = vectors[i][axis];
      }
    }
  }

  int size() const { return size_; }
  Eigen::Vector3d operator[](int i) const {
    return {coordinates_[0][i], coordinates_[1][i], coordinates_[2][i]};
  }

  /// A coordinate of vectors i, i + 1, ... to the end of the padding.
  const double* from(int axis, int i) const { return &coordinates_[axis][i]; }

  /// Vectors i to i + 3; i a multiple of four below size().
  PacketVector packet(int i) const { return {load(0, i), load(1, i), load(2, i)}; }

 private:
  Eigen::Map<const Packet> load(int axis, int i) const { return Eigen::Map<const Packet>(from(axis, i)); }

  int size_ = 0;
  std::vector<double> coordinates_[3];
};

}  // namespace mono_pose_tracker
