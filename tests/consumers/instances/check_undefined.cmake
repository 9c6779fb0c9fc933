# SPDX-License-Identifier: BSD-3-Clause
# Fails unless OBJECTS take RtkEstimator's update() from elsewhere.
execute_process(COMMAND "${NM}" -C ${OBJECTS} OUTPUT_VARIABLE symbols RESULT_VARIABLE status)
if(NOT status EQUAL 0 OR NOT symbols MATCHES " U [^\n]*RtkEstimator<[^\n]*>::update\\(")
  message(FATAL_ERROR "the program's object file does not take RtkEstimator::update() from the library of instances")
endif()
if(symbols MATCHES " [TtWwVv] [^\n]*FixedLagSmoother<[^\n]*>::optimise")
  message(FATAL_ERROR "the program's object file holds the smoother once more")
endif()
