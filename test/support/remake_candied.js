// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Writes test/golden/candied.json anew: what the npm package `candied` decodes from frames that come
// in candump's notation, one a line, on stdin. Call it in a folder with that package:
//
//   npm install --no-save --ignore-scripts candied@2.2.0
//   /usr/bin/python3 $ROOT/firmware_bridge/can/corners.py $ROOT/firmware_bridge/can/understory.dbc 8 |
//     node $ROOT/test/support/remake_candied.js $ROOT/firmware_bridge/can/understory.dbc
//
// A row: the frame, the values of all signals in the order of the DBC, the names of its codes.
const fs = require("fs");
const path = require("path");
const { createRequire } = require("module");

// The package is where npm was called, not beside this file.
const { Dbc, Can } = createRequire(path.join(process.cwd(), "x.js"))("candied");

const can = new Can();
can.database = new Dbc().load(fs.readFileSync(process.argv[2], "utf8"));
const rows = fs
  .readFileSync(0, "utf8")
  .split("\n")
  .filter((line) => line)
  .map((line) => {
    const [identifier, data] = line.split("#");
    const bytes = Array.from(Buffer.from(data, "hex"));
    const decoded = can.decode(can.createFrame(parseInt(identifier, 16), bytes));
    const values = [];
    const names = {};
    for (const [name, bound] of decoded.boundSignals) {
      values.push(bound.value);
      if (/^[A-Z]/.test(bound.physValue)) names[name] = bound.physValue;
    }
    return JSON.stringify([line, values, names]);
  });
process.stdout.write(`{"candied": "2.2.0", "frames": [\n${rows.join(",\n")}\n]}\n`);
