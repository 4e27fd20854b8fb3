// Assertions for our own bugs: the same behaviour in every build.
#pragma once

#include <cstdio>
#include <cstdlib>

// Prints the condition and its place, then aborts, if `condition` is false. Never for a caller's input.
#define STANCE_CHECK(condition)                                                                 \
  do {                                                                                          \
    if (!(condition)) {                                                                         \
      std::fprintf(stderr, "%s:%d: STANCE_CHECK failed: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                             \
    }                                                                                           \
  } while (false)
