// SPDX-License-Identifier: BSD-3-Clause
// The whole library but io/ in one object, for check_statics.sh.
#include <searvins/searvins.hpp>
