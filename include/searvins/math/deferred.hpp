// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Types that are settled only where a template is used, so that a header costs its readers little.
///
/// A compiler checks an expression where it is *read* unless its type depends on a template parameter, whether or not anybody calls the
/// function; and every expression of Eigen is a class of its own. What computes with Eigen in this library is therefore a template of
/// its scalar, and the plain name an alias (`using NavigationState = BasicNavigationState<double>`). For the rest:
///
///     math::Vector3<Scalar>            as a parameter of `template <class Scalar = double>`: never deduced, so that expressions,
///                                      braces and views convert to it as they do to Eigen::Vector3d
///     math::Deferred<double, Policy>   double, in a class template whose parameters name no scalar
///     math::DeferredFor<double, N>     the same for a template of numbers
#pragma once

#include <Eigen/Core>

#include <type_traits>

namespace searvins::math {

/// A column of three scalars. No template argument is deduced from it (see the file comment).
template <class Scalar>
using Vector3 = Eigen::Matrix<std::type_identity_t<Scalar>, 3, 1>;
/// A 3 x 3 matrix; not deduced either.
template <class Scalar>
using Matrix3 = Eigen::Matrix<std::type_identity_t<Scalar>, 3, 3>;
/// A column of N scalars; not deduced either.
template <class Scalar, int N>
using Vector = Eigen::Matrix<std::type_identity_t<Scalar>, N, 1>;
/// A Rows x Columns matrix; not deduced either.
template <class Scalar, int Rows, int Columns>
using Matrix = Eigen::Matrix<std::type_identity_t<Scalar>, Rows, Columns>;

namespace detail {

template <class T, class...>
struct DeferredType {
  using type = T;
};
template <class T, auto...>
struct DeferredTypeFor {
  using type = T;
};

}  // namespace detail

/// T, known once the template parameters Policies are.
template <class T, class... Policies>
using Deferred = typename detail::DeferredType<T, Policies...>::type;
/// T, known once the template parameters Numbers are.
template <class T, auto... Numbers>
using DeferredFor = typename detail::DeferredTypeFor<T, Numbers...>::type;

}  // namespace searvins::math
