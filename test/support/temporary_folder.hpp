// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A fresh folder for one test, removed with the object.
#pragma once

#include <filesystem>
#include <string>

namespace understory {

class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  [[nodiscard]] std::string path_of(const std::string& name) const { return path_ / name; }
  // Writes the content and returns the file's path.
  [[nodiscard]] std::string write(const std::string& name, const std::string& content) const;

 private:
  std::filesystem::path path_;
};

}  // namespace understory
