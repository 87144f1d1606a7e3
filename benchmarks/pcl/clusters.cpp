// SPDX-FileCopyrightText: 2026 topo_region_seg contributors
// SPDX-License-Identifier: Apache-2.0
// clusters CLOUD WIDTH HEIGHT RADIUS STEPS COLOR ANGLE REPEATS LABELS
//   CLOUD: rows of 9 float64: position (m), CIELAB, unit normal; rows that are not finite are no points.
//   Conditional Euclidean clustering at STEPS scales up to RADIUS (m), with color differences to COLOR (dE) and
//   angles to ANGLE (degrees). HEIGHT 1 takes PCL's kd-tree, more its search in organized clouds.
//   LABELS: STEPS * WIDTH * HEIGHT int32, -1 for no point.
// normals CLOUD NEIGHBORS THREADS REPEATS
//   NormalEstimationOMP with that many nearest neighbors.

#define PCL_NO_PRECOMPILE
#include <cmath>
#include <pcl/features/normal_3d_omp.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/search/organized.h>
#include <pcl/segmentation/conditional_euclidean_clustering.h>

#include "exchange.hpp"

struct EIGEN_ALIGN16 FeaturePoint {
  PCL_ADD_POINT4D;
  double color[3];
  double normal[3];
  PCL_MAKE_ALIGNED_OPERATOR_NEW
};
POINT_CLOUD_REGISTER_POINT_STRUCT(FeaturePoint, (float, x, x)(float, y, y)(float, z, z))

namespace {

constexpr std::size_t COLUMNS = 9;

template <typename Point>
typename pcl::PointCloud<Point>::Ptr read_positions(const std::vector<double>& rows) {
  auto cloud = std::make_shared<pcl::PointCloud<Point>>();
  cloud->resize(rows.size() / COLUMNS);
  for (std::size_t i = 0; i < cloud->size(); ++i) {
    (*cloud)[i].x = static_cast<float>(rows[COLUMNS * i]);
    (*cloud)[i].y = static_cast<float>(rows[COLUMNS * i + 1]);
    (*cloud)[i].z = static_cast<float>(rows[COLUMNS * i + 2]);
  }
  cloud->is_dense = true;
  return cloud;
}

}  // namespace

std::string clusters(const std::vector<std::string>& arguments) {
  if (arguments.size() != 9) throw std::invalid_argument("clusters takes nine arguments");
  const auto rows = read_numbers<double>(arguments[0]);
  const auto cloud = read_positions<FeaturePoint>(rows);
  auto points = std::make_shared<pcl::Indices>();
  for (std::size_t i = 0; i < cloud->size(); ++i) {
    const double* row = &rows[COLUMNS * i];
    std::copy(row + 3, row + 6, (*cloud)[i].color);
    std::copy(row + 6, row + 9, (*cloud)[i].normal);
    if (std::all_of(row, row + COLUMNS, [](double value) { return std::isfinite(value); })) points->push_back(i);
  }
  cloud->width = std::stoul(arguments[1]);
  cloud->height = std::stoul(arguments[2]);
  cloud->is_dense = points->size() == cloud->size();
  const double radius = std::stod(arguments[3]);
  const int steps = std::stoi(arguments[4]);
  const double color_square = std::pow(std::stod(arguments[5]), 2);
  const double cosine = std::cos(std::stod(arguments[6]) * M_PI / 180.0);

  const auto alike = [=](const FeaturePoint& a, const FeaturePoint& b, float) {
    const double l = a.color[0] - b.color[0], m = a.color[1] - b.color[1], n = a.color[2] - b.color[2];
    return l * l + m * m + n * n <= color_square &&
           a.normal[0] * b.normal[0] + a.normal[1] * b.normal[1] + a.normal[2] * b.normal[2] >= cosine;
  };
  std::vector<pcl::IndicesClusters> found(steps);
  const auto work = [&] {
    for (int step = 1; step <= steps; ++step) {
      pcl::ConditionalEuclideanClustering<FeaturePoint> clustering;
      clustering.setInputCloud(cloud);
      clustering.setIndices(points);
      clustering.setConditionFunction(alike);
      clustering.setClusterTolerance(static_cast<float>(radius * step / steps));
      clustering.setMinClusterSize(1);
      clustering.segment(found[step - 1]);
    }
  };
  const std::string times = timed("clusters", std::stoi(arguments[7]), work, false);

  std::vector<std::int32_t> labels(steps * cloud->size(), -1);
  for (int step = 0; step < steps; ++step)
    for (std::size_t label = 0; label < found[step].size(); ++label)
      for (const auto point : found[step][label].indices)
        labels[step * cloud->size() + point] = static_cast<std::int32_t>(label);
  write_numbers(arguments[8], labels);
  return times;
}

std::string normals(const std::vector<std::string>& arguments) {
  if (arguments.size() != 4) throw std::invalid_argument("normals takes four arguments");
  const auto cloud = read_positions<pcl::PointXYZ>(read_numbers<double>(arguments[0]));
  pcl::PointCloud<pcl::Normal> found;
  return timed("normals", std::stoi(arguments[3]), [&] {
    pcl::NormalEstimationOMP<pcl::PointXYZ, pcl::Normal> estimation(std::stoi(arguments[2]));
    estimation.setInputCloud(cloud);
    estimation.setSearchMethod(std::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
    estimation.setKSearch(std::stoi(arguments[1]));
    estimation.compute(found);
  });
}
