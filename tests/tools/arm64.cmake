# Toolchain of a build for 64-bit ARM on an amd64 Debian, with the packages of architecture arm64 (tests/tools/arm64.sh).
# protoc and esbuild are programs of this machine; qemu runs our own generators.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_STRIP aarch64-linux-gnu-strip)
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64)
