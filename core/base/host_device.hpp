// Marks functions that run on the host and on a CUDA device alike. Every module may include it.
#pragma once

#if defined(__CUDACC__)
#define SONAR_HD __host__ __device__
#else
#define SONAR_HD
#endif
