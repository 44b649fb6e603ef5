// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/port/candump_writer.hpp"

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <thread>
#include <utility>

#include <boost/lockfree/spsc_queue.hpp>
#include <fcntl.h>

#include "understory/base/config.hpp"
#include "understory/port/candump_log.hpp"

namespace understory::can {
namespace {

constexpr std::chrono::milliseconds kFlushPeriod(100);
constexpr std::size_t kBufferBytes = 1U << 16U;
constexpr mode_t kMode = 0644;
constexpr Duration kClockStep = std::chrono::seconds(1);  // backwards: begin another file

namespace fs = std::filesystem;

// Only files: a log to a device or a pipe must not remove it.
void remove_older_log(const std::string& first) {
  std::error_code ignored;
  for (std::size_t number = 0;; ++number) {
    const fs::path path = candump_path(first, number);
    if (!fs::is_regular_file(fs::symlink_status(path, ignored)) || !fs::remove(path, ignored)) {
      return;
    }
  }
}

std::string letters_and_digits(std::string text) {
  const auto is_other = [](unsigned char letter) { return std::isalnum(letter) == 0; };
  text.erase(std::remove_if(text.begin(), text.end(), is_other), text.end());
  return text;
}

}  // namespace

std::string candump_path(const std::string& first, std::size_t number) {
  if (number == 0) {
    return first;
  }
  fs::path path = first;
  const std::string extension = path.extension();
  return path.replace_extension("." + std::to_string(number) + extension);
}

CandumpFile::CandumpFile(const CandumpLogConfig& config) : config_(config) {
  buffer_.reserve(2 * kBufferBytes);
  config_.interface = letters_and_digits(config_.interface);
  if (config_.interface.empty()) {
    throw ConfigError("log " + config_.path + ": the interface's name has no letter or digit");
  }
  remove_older_log(config_.path);
  if (!open_next()) {
    throw ConfigError(*error_);
  }
}

bool CandumpFile::open_next() {
  const std::string path = candump_path(config_.path, number_);
  UniqueFd file(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kMode));
  if (!file.is_open()) {
    fail("cannot open " + path, errno);
    return false;
  }
  file_ = std::move(file);
  written_bytes_ = 0;
  begun_.reset();
  ++number_;
  ++counters_.files;
  return true;
}

void CandumpFile::add(const PortFrame& frame) {
  const bool is_full = written_bytes_ + buffer_.size() >= config_.largest_bytes;
  const bool is_old =
      begun_ && (frame.stamp - *begun_ >= config_.longest || *begun_ - frame.stamp >= kClockStep);
  if (is_full || is_old) {
    rotate();
  }
  if (!begun_) {
    begun_ = frame.stamp;
  }
  append_candump_line(frame.frame, frame.stamp, config_.interface, buffer_);
  ++buffered_lines_;
  if (buffer_.size() >= kBufferBytes) {
    flush();
  }
}

// When there is no next file, the last one goes on for as long as another one would have.
void CandumpFile::rotate() {
  flush();
  if (!open_next()) {
    written_bytes_ = 0;
    begun_.reset();
  }
}

void CandumpFile::flush() {
  if (buffer_.empty()) {
    return;
  }
  const off_t begin = ::lseek(file_.get(), 0, SEEK_CUR);
  std::size_t done = 0;
  while (done < buffer_.size()) {
    const ssize_t written = ::write(file_.get(), buffer_.data() + done, buffer_.size() - done);
    if (written < 0 && errno == EINTR) {
      continue;
    }
    if (written <= 0) {
      break;
    }
    done += static_cast<std::size_t>(written);
  }
  if (done < buffer_.size()) {
    fail("cannot write " + candump_path(config_.path, number_ - 1), errno);
    counters_.failed += buffered_lines_;
    // No half a line, and none twice.
    if (begin >= 0 && ::ftruncate(file_.get(), begin) == 0) {
      static_cast<void>(::lseek(file_.get(), begin, SEEK_SET));
    }
  } else {
    counters_.lines += buffered_lines_;
    written_bytes_ += buffer_.size();
  }
  buffer_.clear();
  buffered_lines_ = 0;
}

void CandumpFile::fail(const std::string& what, int error) {
  error_ = what + ": " + std::strerror(error);
}

std::optional<std::string> CandumpFile::take_error() {
  return std::exchange(error_, std::nullopt);
}

class CandumpWriter::Thread {
 public:
  explicit Thread(const CandumpLogConfig& config)
      : file_(config),
        queue_(config.queued_frames),
        counters_(file_.counters()),
        thread_([this] { write(); }) {}
  Thread(const Thread&) = delete;
  Thread& operator=(const Thread&) = delete;
  ~Thread() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      is_ending_ = true;
    }
    wake_.notify_one();
    thread_.join();
  }

  void push(const PortFrame& frame) {
    if (!queue_.push(frame)) {
      lost_.fetch_add(1, std::memory_order_relaxed);
    }
  }
  [[nodiscard]] CandumpCounters counters() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    CandumpCounters counters = counters_;
    counters.lost = lost_.load(std::memory_order_relaxed);
    return counters;
  }
  [[nodiscard]] std::optional<std::string> take_error() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::exchange(error_, std::nullopt);
  }

 private:
  void write() {
    bool is_ending = false;
    while (!is_ending) {
      {
        std::unique_lock<std::mutex> lock(mutex_);
        is_ending = wake_.wait_for(lock, kFlushPeriod, [this] { return is_ending_; });
      }
      queue_.consume_all([this](const PortFrame& frame) { file_.add(frame); });
      file_.flush();
      const std::lock_guard<std::mutex> lock(mutex_);
      counters_ = file_.counters();
      if (std::optional<std::string> error = file_.take_error()) {
        error_ = std::move(error);
      }
    }
  }

  CandumpFile file_;  // of the thread alone
  boost::lockfree::spsc_queue<PortFrame> queue_;
  std::atomic<std::uint64_t> lost_{0};
  mutable std::mutex mutex_;  // what follows
  std::condition_variable wake_;
  bool is_ending_ = false;
  CandumpCounters counters_;
  std::optional<std::string> error_;
  std::thread thread_;  // the last, because it uses the others
};

CandumpWriter::CandumpWriter(const CandumpLogConfig& config)
    : thread_(std::make_unique<Thread>(config)) {}

CandumpWriter::~CandumpWriter() = default;

void CandumpWriter::on_port_frame(const PortFrame& frame) {
  thread_->push(frame);
}

CandumpCounters CandumpWriter::counters() const {
  return thread_->counters();
}

std::optional<std::string> CandumpWriter::take_error() {
  return thread_->take_error();
}

}  // namespace understory::can
