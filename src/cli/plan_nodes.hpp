// What `raypager plan --nodes` says of clusters.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "cli/option_parser.hpp"
#include "raypager/cluster_forecast.hpp"

namespace raypager {

struct PlanNodes {
    ClusterForecastOptions how;  // how.nodes is empty: not asked for
    bool link_given = false;
};
void add_node_options(OptionParser& parser, PlanNodes& nodes);
Status check_node_options(const OptionParser& parser, const PlanNodes& nodes);

std::string nodes_text(const ClusterForecast& forecast, double link);
nlohmann::ordered_json nodes_json(const ClusterForecast& forecast, double link);

}  // namespace raypager
