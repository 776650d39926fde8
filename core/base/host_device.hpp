// Marks functions that are compiled for the host and for CUDA devices. Every module may include it.
#pragma once

#if defined(__CUDACC__)
#define SONAR_HD __host__ __device__
#else
#define SONAR_HD
#endif
