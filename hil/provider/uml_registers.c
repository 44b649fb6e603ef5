// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Preloaded into User-Mode Linux on processors whose extended registers do not fit into the buffer
// that its kernel 6.1 has for them (those with AMX). It asks ptrace() to restore only as much as it
// kept, which the host refuses with EFAULT, and then gives up. Here the rest is filled in: as the
// initial state of the matrix registers, which no program inside has the permission to use.
#include <errno.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

enum { kXstate = 0x202, kHeaderAt = 512, kLargest = 65536 };
static const unsigned long kMatrixRegisters = (1UL << 17) | (1UL << 18);

static unsigned char whole[kLargest];
static size_t whole_size;

static long restore_xstate(long pid, const struct iovec* part) {
  if (whole_size == 0) {
    struct iovec all = {whole, sizeof whole};
    if (syscall(SYS_ptrace, PTRACE_GETREGSET, pid, kXstate, &all) != 0) return -1;
    whole_size = all.iov_len;
  }
  struct iovec filled = {whole, whole_size};
  if (part->iov_len >= whole_size) {
    return syscall(SYS_ptrace, PTRACE_SETREGSET, pid, kXstate, part);
  }
  memcpy(whole, part->iov_base, part->iov_len);
  memset(whole + part->iov_len, 0, whole_size - part->iov_len);
  unsigned long present;
  memcpy(&present, whole + kHeaderAt, sizeof present);
  present &= ~kMatrixRegisters;
  memcpy(whole + kHeaderAt, &present, sizeof present);
  return syscall(SYS_ptrace, PTRACE_SETREGSET, pid, kXstate, &filled);
}

// As that of the C library, which this takes the place of.
long ptrace(enum __ptrace_request request, ...) {
  va_list arguments;
  va_start(arguments, request);
  const long pid = va_arg(arguments, int);
  const long address = va_arg(arguments, long);
  void* data = va_arg(arguments, void*);
  va_end(arguments);
  if (request == PTRACE_SETREGSET && address == kXstate) return restore_xstate(pid, data);
  if (request == PTRACE_PEEKTEXT || request == PTRACE_PEEKDATA || request == PTRACE_PEEKUSER) {
    long value = 0;
    if (syscall(SYS_ptrace, request, pid, address, &value) != 0) return -1;
    errno = 0;
    return value;
  }
  return syscall(SYS_ptrace, request, pid, address, data);
}
