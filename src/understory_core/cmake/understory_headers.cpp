// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A library needs a file: this one is compiled for the headers that come before it.
namespace understory {}
