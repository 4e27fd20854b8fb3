// Eight floats, or integers, that the compiler maps to the instruction set at hand (GCC's and Clang's vector
// extension). For the loops that no compiler vectorises by itself, since a sum of floats may not be
// reordered.
#pragma once

#include <cstdint>

namespace stance {

// Needs no more alignment than a float does.
typedef float Lanes __attribute__((vector_size(32), aligned(4), may_alias));

typedef int32_t IntLanes __attribute__((vector_size(32), aligned(4), may_alias));

// The eight floats from `at` on. Inlined always: it must be compiled for the instruction set of the loop
// around it.
[[gnu::always_inline]] inline const Lanes& LanesAt(const float* at) {
  return *reinterpret_cast<const Lanes*>(at);
}
[[gnu::always_inline]] inline Lanes& LanesAt(float* at) { return *reinterpret_cast<Lanes*>(at); }

[[gnu::always_inline]] inline IntLanes& IntLanesAt(int32_t* at) { return *reinterpret_cast<IntLanes*>(at); }

}  // namespace stance
