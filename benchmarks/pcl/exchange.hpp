// SPDX-FileCopyrightText: 2026 topo_region_seg contributors
// SPDX-License-Identifier: Apache-2.0
// Files of bare numbers in, one JSON object out, and the stopwatch.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

template <typename T>
std::vector<T> read_numbers(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  std::vector<T> numbers(static_cast<std::size_t>(file.tellg()) / sizeof(T));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(numbers.data()), static_cast<std::streamsize>(numbers.size() * sizeof(T)));
  return numbers;
}

inline void write_numbers(const std::string& path, const std::vector<std::int32_t>& numbers) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(numbers.data()),
             static_cast<std::streamsize>(numbers.size() * sizeof(std::int32_t)));
  if (!file) throw std::runtime_error(path + ": cannot be written");
}

constexpr double ENOUGH_MS = 8000.0;

// Run `repeats` times, but begin none after ENOUGH_MS, after once to warm up; "name": {"times_ms": [...]} as JSON.
inline std::string timed(const std::string& name, int repeats, const std::function<void()>& work, bool warm_up = true) {
  std::string json = "\"" + name + "\": {\"times_ms\": [";
  if (warm_up) work();
  double total = 0.0;
  for (int i = 0; i < repeats && total < ENOUGH_MS; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double, std::milli> passed = std::chrono::steady_clock::now() - start;
    total += passed.count();
    json += (i ? ", " : "") + std::to_string(passed.count());
  }
  return json + "]}";
}

// Each takes the arguments after its name and returns the members of a JSON object.
std::string clusters(const std::vector<std::string>& arguments);
std::string normals(const std::vector<std::string>& arguments);
std::string frame(const std::vector<std::string>& arguments);
std::string objects(const std::vector<std::string>& arguments);
std::string region_growing(const std::vector<std::string>& arguments);
std::string supervoxels(const std::vector<std::string>& arguments);
