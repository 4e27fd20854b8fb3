// Marks a hot loop to be compiled for several instruction sets, the best one chosen when the program starts.
//
// No translation unit is compiled with -march, so that one binary runs on every x86-64 machine; the few
// loops where it pays carry this mark. Sanitizers run before GCC's resolvers can, so there it is empty.
#pragma once

#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define STANCE_MULTIVERSION __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define STANCE_MULTIVERSION
#endif
