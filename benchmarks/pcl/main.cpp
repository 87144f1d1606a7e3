// SPDX-FileCopyrightText: 2026 topo_region_seg contributors
// SPDX-License-Identifier: Apache-2.0
// usage: pcl_peers clusters|normals|frame|objects|region_growing|supervoxels ARGUMENT...
// (each file says what its commands take)

#include <iostream>
#include <pcl/console/print.h>
#include <pcl/pcl_config.h>

#include "exchange.hpp"

int main(int count, char** values) {
  pcl::console::setVerbosityLevel(pcl::console::L_ERROR);
  const std::vector<std::string> arguments(values + std::min(count, 2), values + count);
  const std::string command = count > 1 ? values[1] : "";
  try {
    std::string members;
    if (command == "clusters") members = clusters(arguments);
    else if (command == "normals") members = normals(arguments);
    else if (command == "frame") members = frame(arguments);
    else if (command == "objects") members = objects(arguments);
    else if (command == "region_growing") members = region_growing(arguments);
    else if (command == "supervoxels") members = supervoxels(arguments);
    else throw std::invalid_argument("no such command: " + command);
    std::cout << "{\"pcl\": \"" << PCL_VERSION_PRETTY << "\", " << members << "}\n";
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "pcl_peers: " << error.what() << '\n';
    return 2;
  }
}
