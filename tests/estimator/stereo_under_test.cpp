// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/stereo_under_test_definitions.hpp"

template class searvins::test::CameraEstimatorUnderTest<searvins::estimator::KnownCamera>;
