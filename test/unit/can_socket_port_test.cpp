// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What can be told of the socket port on every machine, with CAN or without. The rest is tested on
// a bus (hil/test).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "understory/base/config.hpp"
#include "understory/port/socket_can_port.hpp"

namespace understory::can {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::string error_of(const std::string& interface) {
  try {
    const SocketCanPort port(interface, IdSet());
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "none";
}

TEST(SocketCanPort, WithoutTheInterfaceTheErrorNamesItAndSaysWhatToDo) {
  const std::string error = error_of("nosuchcan0");

  EXPECT_THAT(error, HasSubstr("'nosuchcan0'"));
  EXPECT_THAT(error, AnyOf(HasSubstr("does not exist; "), HasSubstr("`understory hil`")));
  EXPECT_THAT(error, Not(HasSubstr("\n")));
}

TEST(SocketCanPort, ANameThatNoInterfaceCanHaveIsRefused) {
  EXPECT_THAT(error_of("sixteen_letters_"), HasSubstr("1 to 15 characters"));
  EXPECT_THAT(error_of(""), HasSubstr("1 to 15 characters"));
}

}  // namespace
}  // namespace understory::can
