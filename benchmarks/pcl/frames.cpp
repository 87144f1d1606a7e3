// SPDX-FileCopyrightText: 2026 topo_region_seg contributors
// SPDX-License-Identifier: Apache-2.0
// frame FRAME WIDTH HEIGHT DISTANCE VOXEL REPEATS
//   FRAME: rows of x, y, z (m) float32 and the bits of 0x00RRGGBB, organized; NaN where there is no depth.
//   Normals by integral images, the dominant plane by RANSAC with inliers to DISTANCE (m), a voxel grid of edge VOXEL (m).

#include <cstring>
#include <pcl/common/point_tests.h>
#include <pcl/features/integral_image_normal.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/segmentation/sac_segmentation.h>

#include "exchange.hpp"

using Point = pcl::PointXYZRGB;

std::string frame(const std::vector<std::string>& arguments) {
  if (arguments.size() != 6) throw std::invalid_argument("frame takes six arguments");
  const auto numbers = read_numbers<float>(arguments[0]);
  auto cloud = std::make_shared<pcl::PointCloud<Point>>(std::stoul(arguments[1]), std::stoul(arguments[2]));
  if (cloud->size() * 4 != numbers.size()) throw std::invalid_argument(arguments[0] + ": not of that size");
  for (std::size_t i = 0; i < cloud->size(); ++i) {
    Point& point = (*cloud)[i];
    std::copy(&numbers[4 * i], &numbers[4 * i] + 3, point.data);
    std::memcpy(&point.rgba, &numbers[4 * i + 3], sizeof(point.rgba));
  }
  cloud->is_dense = false;
  const int repeats = std::stoi(arguments[5]);

  pcl::PointCloud<pcl::Normal> normals;
  std::string json = timed("integral_image_normals", repeats, [&] {
    pcl::IntegralImageNormalEstimation<Point, pcl::Normal> estimation;
    estimation.setNormalEstimationMethod(estimation.AVERAGE_3D_GRADIENT);
    estimation.setMaxDepthChangeFactor(0.02f);
    estimation.setNormalSmoothingSize(10.0f);
    estimation.setInputCloud(cloud);
    estimation.compute(normals);
  });

  auto valid = std::make_shared<pcl::Indices>();
  for (std::size_t i = 0; i < cloud->size(); ++i)
    if (pcl::isFinite((*cloud)[i])) valid->push_back(static_cast<pcl::index_t>(i));
  pcl::ModelCoefficients plane;
  pcl::PointIndices inliers;
  json += ", " + timed("ransac_plane", repeats, [&] {
    pcl::SACSegmentation<Point> segmentation;
    segmentation.setOptimizeCoefficients(true);
    segmentation.setModelType(pcl::SACMODEL_PLANE);
    segmentation.setMethodType(pcl::SAC_RANSAC);
    segmentation.setDistanceThreshold(std::stod(arguments[3]));
    segmentation.setInputCloud(cloud);
    segmentation.setIndices(valid);
    segmentation.segment(inliers, plane);
  });

  pcl::PointCloud<Point> thinned;
  const float edge = std::stof(arguments[4]);
  json += ", " + timed("voxel_grid", repeats, [&] {
    pcl::VoxelGrid<Point> grid;
    grid.setInputCloud(cloud);
    grid.setLeafSize(edge, edge, edge);
    grid.filter(thinned);
  });

  json += ", \"points\": " + std::to_string(valid->size());
  json += ", \"inliers\": " + std::to_string(inliers.indices.size());
  json += ", \"voxels\": " + std::to_string(thinned.size()) + ", \"plane\": [";
  for (std::size_t i = 0; i < plane.values.size(); ++i) json += (i ? ", " : "") + std::to_string(plane.values[i]);
  return json + "]";
}
