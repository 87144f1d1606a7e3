// SPDX-FileCopyrightText: 2026 topo_region_seg contributors
// SPDX-License-Identifier: Apache-2.0
// supervoxels POINTS VOXEL SEED REPEATS LABELS
//   POINTS: rows of x, y, z (m) float32 and the bits of 0x00RRGGBB, in the sensor frame, all finite. VCCS with voxels of
//   edge VOXEL (m), seeds SEED (m) apart and PCL's own weights; writes the label of each point, 0 = none (int32).

#include <cstring>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/segmentation/supervoxel_clustering.h>

#include "exchange.hpp"

using Point = pcl::PointXYZRGBA;

std::string supervoxels(const std::vector<std::string>& arguments) {
  if (arguments.size() != 5) throw std::invalid_argument("supervoxels takes five arguments");
  const auto numbers = read_numbers<float>(arguments[0]);
  auto cloud = std::make_shared<pcl::PointCloud<Point>>(numbers.size() / 4, 1);
  for (std::size_t i = 0; i < cloud->size(); ++i) {
    Point& point = (*cloud)[i];
    std::copy(&numbers[4 * i], &numbers[4 * i] + 3, point.data);
    std::memcpy(&point.rgba, &numbers[4 * i + 3], sizeof(point.rgba));
    point.a = 255;
  }
  cloud->is_dense = true;
  const float voxel = std::stof(arguments[1]), seed = std::stof(arguments[2]);

  std::map<std::uint32_t, pcl::Supervoxel<Point>::Ptr> found;
  pcl::PointCloud<pcl::PointXYZL>::Ptr labeled;
  const std::string times = timed("supervoxels", std::stoi(arguments[3]), [&] {
    pcl::SupervoxelClustering<Point> clustering(voxel, seed);
    clustering.setUseSingleCameraTransform(false);
    clustering.setInputCloud(cloud);
    found.clear();
    clustering.extract(found);
    labeled = clustering.getLabeledCloud();
  }, false);
  std::vector<std::int32_t> labels(cloud->size());
  for (std::size_t i = 0; i < cloud->size(); ++i) labels[i] = static_cast<std::int32_t>((*labeled)[i].label);
  write_numbers(arguments[4], labels);
  return times;
}
