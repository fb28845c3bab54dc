#include "five_point_constraints.h"

namespace mono_pose_tracker {
namespace {

using Packet = Eigen::Array<double, 4, 1>;  // four polynomials at once
enum Monomial { kXX, kXY, kYY, kXZ, kYZ, kZZ, kX, kY, kZ, kOne };
constexpr int kQuadraticOf[4][4] = {
    {kXX, kXY, kXZ, kX}, {kXY, kYY, kYZ, kY}, {kXZ, kYZ, kZZ, kZ}, {kX, kY, kZ, kOne}};

/// Coefficients of x, y, z and 1.
struct Linear {
  Packet c[4];
};

/// Coefficients of xx xy yy xz yz zz x y z 1.
struct Quadratic {
  Packet c[10];
};

/// Element i of the packet holds entry entries[i] of the solution: x, y, z and 1 times the basis.
Linear linear(const Row10 (&basis)[4], const int (&entries)[4]) {
  Linear result;
  for (int k = 0; k < 4; ++k) {
    result.c[k] << basis[k][entries[0]], basis[k][entries[1]], basis[k][entries[2]], basis[k][entries[3]];
  }
  return result;
}

/// sum += sign a b.
void add_product(double sign, const Linear& a, const Linear& b, Quadratic* sum) {
  for (int k = 0; k < 4; ++k) {
    const Packet signed_k = sign * a.c[k];
    for (int l = 0; l < 4; ++l) sum->c[kQuadraticOf[k][l]] += signed_k * b.c[l];
  }
}

Quadratic product(const Linear& a, const Linear& b) {
  Quadratic q;
  for (int k = 0; k < 4; ++k) {
    q.c[kQuadraticOf[k][k]] = a.c[k] * b.c[k];
    for (int l = k + 1; l < 4; ++l) q.c[kQuadraticOf[k][l]] = a.c[k] * b.c[l] + a.c[l] * b.c[k];
  }
  return q;
}

Quadratic permuted(const Quadratic& q, const int (&order)[4]) {
  Quadratic result;
  for (int k = 0; k < 10; ++k) {
    result.c[k] << q.c[k][order[0]], q.c[k][order[1]], q.c[k][order[2]], q.c[k][order[3]];
  }
  return result;
}

/// sum += q l, a cubic in the order of Constraints.
void add_product(const Quadratic& quadratic, const Linear& linear, Packet (&sum)[20]) {
  const Packet(&q)[10] = quadratic.c;
  const Packet(&a)[4] = linear.c;
  sum[0] += q[kXX] * a[0];
  sum[1] += q[kYY] * a[1];
  sum[2] += q[kXX] * a[1] + q[kXY] * a[0];
  sum[3] += q[kXY] * a[1] + q[kYY] * a[0];
  sum[4] += q[kXX] * a[2] + q[kXZ] * a[0];
  sum[5] += q[kXX] * a[3] + q[kX] * a[0];
  sum[6] += q[kYY] * a[2] + q[kYZ] * a[1];
  sum[7] += q[kYY] * a[3] + q[kY] * a[1];
  sum[8] += q[kXY] * a[2] + q[kXZ] * a[1] + q[kYZ] * a[0];
  sum[9] += q[kXY] * a[3] + q[kX] * a[1] + q[kY] * a[0];
  sum[10] += q[kXZ] * a[2] + q[kZZ] * a[0];
  sum[11] += q[kXZ] * a[3] + q[kX] * a[2] + q[kZ] * a[0];
  sum[12] += q[kX] * a[3] + q[kOne] * a[0];
  sum[13] += q[kYZ] * a[2] + q[kZZ] * a[1];
  sum[14] += q[kYZ] * a[3] + q[kY] * a[2] + q[kZ] * a[1];
  sum[15] += q[kY] * a[3] + q[kOne] * a[1];
  sum[16] += q[kZZ] * a[2];
  sum[17] += q[kZZ] * a[3] + q[kZ] * a[2];
  sum[18] += q[kZ] * a[3] + q[kOne] * a[2];
  sum[19] += q[kOne] * a[3];
}

/// det B = 0 and adj(B) s = 0, rows 9 and 0 to 2; the cofactors of the diagonal and of the entries 23, 13 and
/// 12 are left in adjugate and adjugate_off.
void rank_constraints(const Row10 (&basis)[4], Quadratic* adjugate, Quadratic* adjugate_off, Constraints* m) {
  const Linear off = linear(basis, {kB23, kB13, kB12, kB23});
  *adjugate = product(linear(basis, {kB22, kB33, kB11, kB22}), linear(basis, {kB33, kB11, kB22, kB33}));
  add_product(-1, off, off, adjugate);
  *adjugate_off = product(linear(basis, {kB12, kB12, kB13, kB12}), linear(basis, {kB13, kB23, kB23, kB13}));
  add_product(-1, linear(basis, {kB11, kB22, kB33, kB11}), off, adjugate_off);
  Packet sum[20];
  for (Packet& s : sum) s.setZero();
  add_product(*adjugate, linear(basis, {kS1, kS2, kS3, kB11}), sum);
  add_product(permuted(*adjugate_off, {2, 0, 1, 2}), linear(basis, {kS2, kS3, kS1, kB12}), sum);
  add_product(permuted(*adjugate_off, {1, 2, 0, 1}), linear(basis, {kS3, kS1, kS2, kB13}), sum);
  for (int c = 0; c < 20; ++c) {
    for (int i = 0; i < 3; ++i) (*m)(i, c) = sum[c][i];
    (*m)(9, c) = sum[c][3];
  }
}

/// [s]x B [s]x = scale^2 tr(B) adj(B), the diagonal in rows 3 to 5, the entries 23, 13 and 12 in rows 6 to 8.
/// -[s]x B [s]x is what the cofactors of B gain by s s^T.
void parallax_constraints(const Row10 (&basis)[4], double scale, const Quadratic& adjugate,
                          const Quadratic& adjugate_off, Constraints* m) {
  const Linear s = linear(basis, {kS1, kS2, kS3, kS1});
  const Quadratic squares = product(s, s);
  const Quadratic products =
      product(linear(basis, {kS2, kS1, kS1, kS2}), linear(basis, {kS3, kS3, kS2, kS3}));
  const Linear off = linear(basis, {kB23, kB13, kB12, kB23});
  Linear minus_two_off, minus_off, minus_diagonal, scaled_trace;
  const Linear diagonal = linear(basis, {kB11, kB22, kB33, kB11});
  for (int k = 0; k < 4; ++k) {
    minus_two_off.c[k] = -2 * off.c[k];
    minus_off.c[k] = -off.c[k];
    minus_diagonal.c[k] = -diagonal.c[k];
    scaled_trace.c[k].setConstant(scale * scale * (basis[k][kB11] + basis[k][kB22] + basis[k][kB33]));
  }
  Packet sum[20], sum_off[20];
  for (Packet& cubic : sum) cubic.setZero();
  for (Packet& cubic : sum_off) cubic.setZero();
  add_product(permuted(squares, {2, 0, 1, 2}), linear(basis, {kB22, kB33, kB11, kB22}), sum);
  add_product(permuted(squares, {1, 2, 0, 1}), linear(basis, {kB33, kB11, kB22, kB33}), sum);
  add_product(products, minus_two_off, sum);
  add_product(adjugate, scaled_trace, sum);
  add_product(permuted(products, {1, 0, 0, 1}), linear(basis, {kB12, kB12, kB13, kB12}), sum_off);
  add_product(permuted(products, {2, 2, 1, 2}), linear(basis, {kB13, kB23, kB23, kB13}), sum_off);
  add_product(products, minus_diagonal, sum_off);
  add_product(squares, minus_off, sum_off);
  add_product(adjugate_off, scaled_trace, sum_off);
  for (int c = 0; c < 20; ++c) {
    for (int i = 0; i < 3; ++i) {
      (*m)(3 + i, c) = sum[c][i];
      (*m)(6 + i, c) = sum_off[c][i];
    }
  }
}

}  // namespace

Constraints essential_constraints(const Row10 (&basis)[4], double scale) {
  Constraints m;
  Quadratic adjugate, adjugate_off;
  rank_constraints(basis, &adjugate, &adjugate_off, &m);
  parallax_constraints(basis, scale, adjugate, adjugate_off, &m);
  return m;
}

}  // namespace mono_pose_tracker
