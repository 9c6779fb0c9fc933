// SPDX-License-Identifier: BSD-3-Clause
// Proof that check_statics.sh sees what it looks for: the three mutable statics here must be found, the constant must not.
namespace searvins::control {

inline constexpr double kConstant = 1.5;
inline int mutable_variable = 0;

inline int& mutable_local() {
  static int counter = 0;
  return counter;
}

template <class T>
struct Holder {
  static inline T mutable_member{};
};

const double* use() {
  ++mutable_variable;
  ++mutable_local();
  ++Holder<int>::mutable_member;
  return &kConstant;
}

}  // namespace searvins::control
