// SPDX-FileCopyrightText: 2026 topo_region_seg contributors
// SPDX-License-Identifier: Apache-2.0
// region_growing POINTS NEIGHBORS SMALLEST ANGLE CURVATURE REPEATS LABELS
//   POINTS: rows of x, y, z (m) float32 and the bits of 0x00RRGGBB, all finite. RegionGrowing with normals from NEIGHBORS
//   points, angles to ANGLE (degrees), curvature to CURVATURE; writes each point's region, counted from 1, 0 = none (int32).

#include <cmath>
#include <pcl/features/normal_3d_omp.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/region_growing.h>

#include "exchange.hpp"

using Point = pcl::PointXYZ;

std::string region_growing(const std::vector<std::string>& arguments) {
  if (arguments.size() != 7) throw std::invalid_argument("region_growing takes seven arguments");
  const auto numbers = read_numbers<float>(arguments[0]);
  auto cloud = std::make_shared<pcl::PointCloud<Point>>(numbers.size() / 4, 1);
  for (std::size_t i = 0; i < cloud->size(); ++i)
    std::copy(&numbers[4 * i], &numbers[4 * i] + 3, (*cloud)[i].data);
  cloud->is_dense = true;
  const int neighbors = std::stoi(arguments[1]);
  const float angle = std::stof(arguments[3]) * static_cast<float>(M_PI) / 180.0f;

  std::vector<pcl::PointIndices> regions;
  const std::string times = timed("region_growing", std::stoi(arguments[5]), [&] {
    auto tree = std::make_shared<pcl::search::KdTree<Point>>();
    auto normals = std::make_shared<pcl::PointCloud<pcl::Normal>>();
    pcl::NormalEstimationOMP<Point, pcl::Normal> estimation;
    estimation.setSearchMethod(tree);
    estimation.setInputCloud(cloud);
    estimation.setKSearch(neighbors);
    estimation.compute(*normals);
    pcl::RegionGrowing<Point, pcl::Normal> growing;
    growing.setMinClusterSize(std::stoi(arguments[2]));
    growing.setSearchMethod(tree);
    growing.setNumberOfNeighbours(neighbors);
    growing.setInputCloud(cloud);
    growing.setInputNormals(normals);
    growing.setSmoothnessThreshold(angle);
    growing.setCurvatureThreshold(std::stof(arguments[4]));
    regions.clear();
    growing.extract(regions);
  }, false);
  std::vector<std::int32_t> labels(cloud->size(), 0);
  for (std::size_t region = 0; region < regions.size(); ++region)
    for (const auto point : regions[region].indices) labels[point] = static_cast<std::int32_t>(region) + 1;
  write_numbers(arguments[6], labels);
  return times;
}
