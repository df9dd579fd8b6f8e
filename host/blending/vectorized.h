// SPDX-License-Identifier: Apache-2.0
#pragma once

// One machine code for every amd64, one for those with AVX2, FMA and F16C (x86-64-v3), one for those with AVX-512 (v4);
// the loader picks. Results may differ in the last bits between them, never between runs or threads on one machine.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define MF_VECTORIZED __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define MF_VECTORIZED
#endif
