// Mesh files that would crash the program that reads them or exhaust its memory. Each is refused, and the program continues.
#include "tests/core/scene/hostile_meshes.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <new>

#include "core/base/child_process.hpp"
#include "core/scene/files/load_mesh.hpp"
#include "core/scene/files/mesh_exchange.hpp"
#include "core/scene/files/mesh_steps.hpp"
#include "core/scene/import/import_limits.hpp"
#include "tests/core/held_variable.hpp"
#include "tests/core/scene/temporary_files.hpp"
#include "tests/memory_limit.hpp"

namespace sonar {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class HostileMeshes : public ::testing::Test {
 protected:
  HostileMeshes() {
    // If a test needs more than this, it has failed. It must not exhaust the memory of the computer.
    const rlimit most{std::uint64_t{4} << 30, RLIM_INFINITY};
    EXPECT_TRUE(test::is_sanitized || ::setrlimit(RLIMIT_AS, &most) == 0);
  }
  std::string refusal(const std::string& name, const std::string& bytes) {
    const auto mesh = load_mesh({.file = files_.write(name, bytes)});
    return mesh ? "accepted" : mesh.error().text;
  }
  tests::TemporaryFiles files_;
};

TEST_F(HostileMeshes, AreRefusedAndTheProgramContinues) {
  for (const auto& mesh : tests::hostile_meshes()) {
    const std::string text = refusal(mesh.name, mesh.bytes);
    EXPECT_THAT(text, StartsWith(mesh.name + ": "));
    EXPECT_THAT(text, HasSubstr(mesh.words));
    if (const char* folder = std::getenv("SONARD_WRITE_SEEDS"); folder && mesh.bytes.size() < 8192)
      std::ofstream(std::filesystem::path(folder) / mesh.name, std::ios::binary) << mesh.bytes;
  }
}

TEST_F(HostileMeshes, FilesThatAMeshNamesCountByTheirSize) {
  const auto large = files_.write("large.bin", "");
  std::filesystem::resize_file(large, 3'600'000'000);
  EXPECT_THAT(refusal("large.gltf", tests::gltf_with_buffer("large.bin")),
              HasSubstr("large.gltf: is larger than 2 GiB with the files that it names; simplify it"));
}

TEST_F(HostileMeshes, FilesBesideAMeshAndInTheFolderOfItsSceneAreRead) {
  const std::string corners("\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0", 36);
  std::filesystem::create_directories(files_.path("scene/meshes"));
  std::filesystem::create_directories(files_.path("scene/buffers"));
  files_.write("scene/meshes/beside.bin", corners);
  files_.write("scene/buffers/other.bin", corners);
  files_.write("outside.bin", corners);
  const auto load = [&](const std::string& uri, std::optional<std::filesystem::path> folder) {
    const auto mesh = load_mesh({.file = files_.write("scene/meshes/a.gltf", tests::gltf_with_buffer(uri)), .folder = folder});
    return mesh ? "accepted" : mesh.error().text;
  };
  EXPECT_EQ(load("beside.bin", {}), "accepted");
  EXPECT_EQ(load("../buffers/other.bin", files_.path("scene")), "accepted");
  EXPECT_THAT(load("../buffers/other.bin", {}), HasSubstr("outside of its folder"));
  EXPECT_THAT(load("../../outside.bin", files_.path("scene")), HasSubstr("outside of its folder and the scene's"));
}

TEST_F(HostileMeshes, ManyObjectsOfAnObjFileAreReadInAMoment) {
  std::string with, without;
  for (int i = 0; i < 50'000; ++i) {
    const std::string x = std::to_string(i), next = std::to_string(i + 1);
    const std::string triangle =
        "v " + x + " 0 0\nv " + next + " 0 0\nv " + x + " 1 0\n" + (i % 3 == 0 ? "usemtl a\n" : "usemtl b\n") + "f -3 -2 -1\n";
    with += "o part" + x + "\ng group" + x + "\n" + triangle;
    without += triangle;
  }
  const auto many = load_mesh({.file = files_.write("many.obj", with)}),
             one = load_mesh({.file = files_.write("one.obj", without)});
  ASSERT_TRUE(many) << many.error().text;
  ASSERT_TRUE(one);
  EXPECT_EQ(many->centred.mesh, one->centred.mesh);
  EXPECT_EQ(many->material_names, one->material_names);
}

TEST_F(HostileMeshes, WithoutTheImporterTheSentenceSaysWhatIsMissing) {
  const tests::HeldVariable nowhere("SONARD_IMPORT_MESH", "/no/such/importer");
  const std::string text = refusal("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_THAT(text, HasSubstr("a.obj: cannot be read: /no/such/importer cannot be started: No such file"));
}

TEST_F(HostileMeshes, AnImporterThatCrashesOrAnswersNothingIsReported) {
  const auto importer = files_.path("importer");
  const auto with = [&](const std::string& script) {
    files_.write("importer", "#!/bin/sh\n" + script + "\n");
    std::filesystem::permissions(importer, std::filesystem::perms::owner_all);
    const tests::HeldVariable held("SONARD_IMPORT_MESH", importer.c_str());
    return refusal("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  };
  EXPECT_THAT(with("kill -SEGV $$"), HasSubstr("a.obj: cannot be read: the importer crashed on it (Segmentation fault)"));
  EXPECT_THAT(with("kill -KILL $$"), HasSubstr("was killed, most likely because memory was short"));
  EXPECT_THAT(with("echo no library >&2; exit 127"),
              HasSubstr("ended with code 127: no library; check that it has the version of this program"));
  EXPECT_THAT(with("exit 0"), HasSubstr("ended with code 0"));
  EXPECT_THAT(with("head -c 4096 /dev/zero"), HasSubstr("ended with code 0"));
}

// ---- the limits, in a separate process

template <class Work>
std::string answer_of(Work&& work) {
  auto file = MemoryFile::make("answer");
  if (!file) return "no file";
  const pid_t child = ::fork();
  if (child == 0) {
    begin_import_limits({.mesh = {.file = "folder/m.ply"}, .on_disk = true, .parent = 0, .readable = {}, .memory_root = "/"},
                        file->descriptor());
    limit_import(10'000'000);
    work();
    ::_exit(1);
  }
  int status = 0;
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
  const auto answer = read_answer(file->descriptor());
  return !answer ? "none" : *answer ? "a mesh" : answer->error().text;
}

TEST(ImportLimits, TooLittleMemoryEndsTheImportWithAnError) {
  if (!test::memory_is_limited()) GTEST_SKIP() << "the system keeps no such limit";
  const std::string text = answer_of([] { std::vector<char>().reserve(std::size_t{2} << 30); });
  EXPECT_THAT(text,
              AnyOf(HasSubstr("m.ply: takes more than 1122 MiB of memory to read"), HasSubstr("MiB of memory that are left")));
}

TEST(ImportLimits, MemoryIsGivenFreeForWhatComesAfterTheImport) {
  if (test::is_sanitized) GTEST_SKIP() << "the sanitizer keeps this limit";
  EXPECT_EQ(answer_of([] {
              release_import_memory();
              rlimit now{};
              ::_exit(::getrlimit(RLIMIT_AS, &now) == 0 && now.rlim_cur == RLIM_INFINITY ? 0 : 1);
            }),
            "none");
}

TEST(ImportLimits, TheTimeLimitEndsTheImportWithAnError) {
  for (const int signal : {SIGXCPU, SIGALRM})
    EXPECT_EQ(answer_of([&] { ::raise(signal); }),
              "m.ply: is not read within 50 s of processor time; simplify it, or join its objects");
  EXPECT_EQ(answer_of([] {
              rlimit now{};
              ::_exit(::getrlimit(RLIMIT_CPU, &now) == 0 && now.rlim_cur == 50 && ::alarm(0) > 900 ? 0 : 1);
            }),
            "none");
}

TEST(MeshExchange, DamagedAnswersAreRefused) {
  const auto good = clean_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0});
  ASSERT_TRUE(good);
  auto file = MemoryFile::make("answer");
  ASSERT_TRUE(file);
  ASSERT_TRUE(write_answer(file->descriptor(), LoadedMesh{*good, {"a"}, 7}));
  std::string bytes(4096, '\0');
  bytes.resize(static_cast<std::size_t>(::pread(file->descriptor(), bytes.data(), bytes.size(), 0)));
  const auto whole = read_answer(file->descriptor());
  ASSERT_TRUE(whole && *whole);
  EXPECT_EQ((*whole)->centred.mesh, good->mesh);
  EXPECT_EQ((*whole)->lost, 7u);
  for (std::size_t at = 0; at < bytes.size(); ++at)
    for (const char flip : {'\x01', '\x40', '\x80', '\xff'}) {
      std::string damaged = bytes;
      damaged[at] = static_cast<char>(damaged[at] ^ flip);
      auto other = MemoryFile::make("answer");
      ASSERT_EQ(::pwrite(other->descriptor(), damaged.data(), damaged.size(), 0), static_cast<ssize_t>(damaged.size()));
      const auto answer = read_answer(other->descriptor());
      if (!answer || !*answer) continue;
      for (const auto& t : (*answer)->centred.mesh.triangles)
        for (const std::uint32_t k : t) EXPECT_LT(k, (*answer)->centred.mesh.vertices.size()) << at;
      for (const std::uint16_t m : (*answer)->centred.mesh.material) EXPECT_LT(m, (*answer)->material_names.size()) << at;
    }
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    auto other = MemoryFile::make("answer");
    ASSERT_EQ(::pwrite(other->descriptor(), bytes.data(), n, 0), static_cast<ssize_t>(n));
    const auto answer = read_answer(other->descriptor());
    EXPECT_FALSE(answer && *answer) << n;
  }
}

}  // namespace
}  // namespace sonar
