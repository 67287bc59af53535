/* A maze router on a grid: negotiated congestion (McMurchie and Ebeling, 1995).

   Reads on stdin, one item a line, lengths in mm:
     board WIDTH HEIGHT PITCH CLEARANCE VIA EDGE      copper keeps EDGE from the outline
     class WIDTH                                      of tracks, numbered from 0
     pad NET LAYERS X Y WIDTH HEIGHT THROUGH          LAYERS: bits; THROUGH: 1 for a hole
     block LAYERS X1 Y1 X2 Y2                         no copper, no via
     rail NET LAYER WIDTH X1 Y1 X2 Y2                 a track that is there already
     net NET CLASS                                    to be joined: all its pads and rails
     ground NET CLASS                                 each pad on the surface gets a via of its own
   Writes "track NET LAYER WIDTH X1 Y1 X2 Y2" and "via NET X Y"; exit status 1 if a net is left. */
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <iostream>
#include <map>
#include <queue>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {

constexpr int LAYERS = 3; /* front, inner, back; the ground plane has no tracks */
constexpr int VIA_COST = 120, ROUNDS = 80;
constexpr float MARGIN = 0.01F; /* between the centres of two cells */

struct Pad { int net, layers; double x, y, w, h; bool through; };
struct Rail { int net, layer; double w, x1, y1, x2, y2; };
struct Cell { int layer, at; bool operator==(const Cell& o) const { return layer == o.layer && at == o.at; } };
struct Job { int net, cls; bool to_plane; std::vector<int> pads; std::vector<std::vector<Cell>> paths; std::vector<std::pair<int, int>> stamps; };

struct Board {
    double width = 0, height = 0, pitch = 0.1, clearance = 0.2, via = 0.6, edge = 0.5;
    int nx = 0, ny = 0;
    std::vector<double> classes;
    std::vector<Pad> pads;
    std::vector<Rail> rails;
    std::vector<std::array<double, 5>> blocks;
    std::vector<Job> jobs;
    /* Who may be here: 0 all, a net only that, -1 nobody. A map for each class and layer; the last for vias. */
    std::vector<std::vector<int16_t>> owner;
    std::vector<std::vector<uint8_t>> used; /* how many jobs keep others away from here */
    std::vector<std::vector<uint32_t>> mark;
    std::vector<float> past;
    uint32_t epoch = 0;
    std::vector<uint32_t> drilled; /* too near a via of the same job, by its number */
    uint32_t job_number = 0;

    int maps() const { return int(classes.size()) * LAYERS + 1; }
    int map_of(int cls, int layer) const { return cls * LAYERS + layer; }
    int vias() const { return maps() - 1; }
    double radius(int map) const { return map == vias() ? via / 2 : classes[size_t(map / LAYERS)] / 2; }
    int cell(double x, double y) const {
        int i = std::clamp(int(std::lround(x / pitch)), 0, nx - 1), j = std::clamp(int(std::lround(y / pitch)), 0, ny - 1);
        return j * nx + i;
    }
};

void claim(int16_t& owner, int net) { owner = owner == 0 || owner == net ? int16_t(net) : int16_t(-1); }

/* Every cell nearer than `far` to a rectangle, by its half sides. */
template <class Do> void near_rectangle(const Board& b, double x, double y, double hw, double hh, double far, Do what) {
    int i0 = std::max(0, int((x - hw - far) / b.pitch)), i1 = std::min(b.nx - 1, int((x + hw + far) / b.pitch) + 1);
    int j0 = std::max(0, int((y - hh - far) / b.pitch)), j1 = std::min(b.ny - 1, int((y + hh + far) / b.pitch) + 1);
    for (int j = j0; j <= j1; j++)
        for (int i = i0; i <= i1; i++) {
            double dx = std::max(0.0, std::fabs(i * b.pitch - x) - hw), dy = std::max(0.0, std::fabs(j * b.pitch - y) - hh);
            if (dx * dx + dy * dy < far * far) what(j * b.nx + i);
        }
}

void keep_out(Board& b) {
    b.owner.assign(size_t(b.maps()), std::vector<int16_t>(size_t(b.nx) * b.ny, 0));
    for (int m = 0; m < b.maps(); m++) {
        auto& owner = b.owner[size_t(m)];
        double r = b.radius(m), far = r + b.clearance + MARGIN;
        bool via = m == b.vias();
        int bit = via ? 7 : 1 << (m % LAYERS);
        for (int j = 0; j < b.ny; j++)
            for (int i = 0; i < b.nx; i++) {
                double out = std::min({i * b.pitch, j * b.pitch, b.width - i * b.pitch, b.height - j * b.pitch});
                if (out < b.edge + r) owner[size_t(j) * b.nx + i] = -1;
            }
        for (const auto& k : b.blocks)
            if (int(k[0]) & bit)
                near_rectangle(b, (k[1] + k[3]) / 2, (k[2] + k[4]) / 2, (k[3] - k[1]) / 2, (k[4] - k[2]) / 2, far, [&](int c) { owner[size_t(c)] = -1; });
        for (const Rail& l : b.rails)
            if (via || l.layer == m % LAYERS)
                near_rectangle(b, (l.x1 + l.x2) / 2, (l.y1 + l.y2) / 2, std::fabs(l.x2 - l.x1) / 2 + l.w / 2, std::fabs(l.y2 - l.y1) / 2 + l.w / 2, far,
                               [&](int c) { claim(owner[size_t(c)], l.net); });
        for (const Pad& p : b.pads) {
            if (!(p.layers & bit)) continue;
            near_rectangle(b, p.x, p.y, p.w / 2, p.h / 2, far, [&](int c) { claim(owner[size_t(c)], p.net > 0 ? p.net : -1); });
            if (via) near_rectangle(b, p.x, p.y, p.w / 2, p.h / 2, r + 0.05, [&](int c) { owner[size_t(c)] = -1; });
        }
    }
}

void stamp_disk(Board& b, Job& job, int map, int at, double far) {
    auto& mark = b.mark[size_t(map)];
    int n = int(far / b.pitch) + 1, ci = at % b.nx, cj = at / b.nx;
    for (int j = std::max(0, cj - n); j <= std::min(b.ny - 1, cj + n); j++)
        for (int i = std::max(0, ci - n); i <= std::min(b.nx - 1, ci + n); i++) {
            double d2 = double((i - ci) * (i - ci) + (j - cj) * (j - cj)) * b.pitch * b.pitch;
            size_t c = size_t(j) * b.nx + i;
            if (d2 >= far * far || mark[c] == b.epoch) continue;
            mark[c] = b.epoch;
            b.used[size_t(map)][c]++;
            job.stamps.emplace_back(map, int(c));
        }
}

void stamp(Board& b, Job& job) {
    b.epoch++;
    double half = b.classes[size_t(job.cls)] / 2;
    for (const auto& path : job.paths)
        for (size_t k = 0; k < path.size(); k++) {
            bool via = k && path[k].layer != path[k - 1].layer;
            for (int m = 0; m < b.maps(); m++)
                if (via || m == b.vias() || m % LAYERS == path[k].layer)
                    stamp_disk(b, job, m, path[k].at, b.radius(m) + (via ? b.via / 2 : half) + b.clearance + MARGIN);
        }
}

void unstamp(Board& b, Job& job) {
    for (auto [map, c] : job.stamps) b.used[size_t(map)][size_t(c)]--;
    job.stamps.clear();
    job.paths.clear();
}

std::vector<Cell> cells_of(const Board& b, const Pad& p) {
    std::vector<Cell> out;
    for (int layer = 0; layer < LAYERS; layer++)
        if (p.layers & (1 << layer)) out.push_back({layer, b.cell(p.x, p.y)});
    return out;
}

struct Search {
    Board& b;
    std::vector<float> cost;
    std::vector<int> from;
    std::vector<uint32_t> seen, goal;
    uint32_t epoch = 0;
    explicit Search(Board& board) : b(board) {
        size_t n = size_t(b.nx) * b.ny * LAYERS;
        cost.resize(n); from.resize(n); seen.assign(n, 0); goal.assign(n, 0);
    }

    /* The cheapest way from any of `tree` to any of `ends`, or, without, to a via; empty where there is none. */
    std::vector<Cell> run(const Job& job, const std::vector<Cell>& tree, const std::vector<Cell>& ends, double pressure) {
        const int plane = b.nx * b.ny;
        epoch++;
        int gx = 0, gy = 0;
        for (Cell e : ends) { goal[size_t(e.layer) * plane + e.at] = epoch; gx = e.at % b.nx; gy = e.at / b.nx; }
        auto guess = [&](int at) {
            if (ends.empty()) return 0.0F;
            int dx = std::abs(at % b.nx - gx), dy = std::abs(at / b.nx - gy);
            return float(10 * std::max(dx, dy) + 4 * std::min(dx, dy));
        };
        using Item = std::pair<float, int>;
        std::priority_queue<Item, std::vector<Item>, std::greater<>> open;
        auto push = [&](int node, float g, int parent) {
            if (seen[size_t(node)] == epoch && cost[size_t(node)] <= g) return;
            seen[size_t(node)] = epoch; cost[size_t(node)] = g; from[size_t(node)] = parent;
            open.emplace(g + guess(node % plane), node);
        };
        for (Cell c : tree) push(c.layer * plane + c.at, 0, -1);
        auto price = [&](int map, int at) {
            int16_t who = b.owner[size_t(map)][size_t(at)];
            if (who != 0 && who != job.net) return -1.0F;
            return (1 + b.past[size_t(at)]) * (1 + float(pressure) * b.used[size_t(map)][size_t(at)]);
        };
        while (!open.empty()) {
            auto [f, node] = open.top(); open.pop();
            int layer = node / plane, at = node % plane;
            float g = cost[size_t(node)];
            if (f > g + guess(at) + 0.01F) continue;
            if (goal[size_t(node)] == epoch) return back(node, plane);
            float drill = price(b.vias(), at);
            if (drill >= 0 && b.drilled[size_t(at)] != b.job_number) {
                if (ends.empty() && from[size_t(node)] >= 0) { auto way = back(node, plane); way.push_back({layer == 0 ? 2 : 0, at}); return way; }
                for (int l = 0; l < LAYERS; l++)
                    if (l != layer && price(b.map_of(job.cls, l), at) >= 0) push(l * plane + at, g + VIA_COST * drill, node);
            }
            int x = at % b.nx, y = at / b.nx;
            for (int dy = -1; dy <= 1; dy++)
                for (int dx = -1; dx <= 1; dx++) {
                    if ((!dx && !dy) || x + dx < 0 || y + dy < 0 || x + dx >= b.nx || y + dy >= b.ny) continue;
                    int next = at + dy * b.nx + dx;
                    float p = price(b.map_of(job.cls, layer), next);
                    if (p < 0) continue;
                    push(layer * plane + next, g + (dx && dy ? 14 : 10) * p, node);
                }
        }
        return {};
    }

    std::vector<Cell> back(int node, int plane) const {
        std::vector<Cell> way;
        for (; node >= 0; node = from[size_t(node)]) way.push_back({node / plane, node % plane});
        std::reverse(way.begin(), way.end());
        return way;
    }
};

/* Two holes of one net need a distance too. */
void drill(Board& b, const std::vector<Cell>& way) {
    const double far = b.via / 2 + 0.3;
    for (size_t k = 1; k < way.size(); k++) {
        if (way[k].layer == way[k - 1].layer) continue;
        int at = way[k].at;
        near_rectangle(b, (at % b.nx) * b.pitch, (at / b.nx) * b.pitch, 0, 0, far, [&](int c) { if (c != at) b.drilled[size_t(c)] = b.job_number; });
    }
}

/* Join all pads and rails of a job; false where one cannot be reached. */
bool route(Board& b, Search& search, Job& job, double pressure) {
    std::vector<Cell> tree;
    b.job_number++;
    for (const Rail& l : b.rails)
        if (l.net == job.net)
            for (double x = l.x1; x <= l.x2; x += b.pitch) tree.push_back({l.layer, b.cell(x, l.y1)});
    std::vector<int> left = job.pads;
    if (tree.empty()) { tree = cells_of(b, b.pads[size_t(left[0])]); left.erase(left.begin()); }
    if (job.to_plane) {
        auto way = search.run(job, tree, {}, pressure);
        if (way.empty()) return false;
        job.paths.push_back(way);
        return true;
    }
    while (!left.empty()) {
        auto distance = [&](int pad) {
            int c = b.cell(b.pads[size_t(pad)].x, b.pads[size_t(pad)].y), best = 1 << 30;
            for (Cell t : tree) best = std::min(best, std::abs(t.at % b.nx - c % b.nx) + std::abs(t.at / b.nx - c / b.nx));
            return best;
        };
        auto next = std::min_element(left.begin(), left.end(), [&](int p, int q) { return distance(p) < distance(q); });
        auto way = search.run(job, tree, cells_of(b, b.pads[size_t(*next)]), pressure);
        left.erase(next);
        if (way.empty()) return false;
        job.paths.push_back(way);
        drill(b, way);
        tree.insert(tree.end(), way.begin(), way.end());
    }
    return true;
}

/* Cells of a job where another is too near. */
std::vector<int> clashes(const Board& b, const Job& job) {
    std::vector<int> out;
    for (const auto& path : job.paths)
        for (size_t k = 0; k < path.size(); k++) {
            bool via = k && path[k].layer != path[k - 1].layer;
            int map = via ? b.vias() : b.map_of(job.cls, path[k].layer);
            if (b.used[size_t(map)][size_t(path[k].at)] > 1) out.push_back(path[k].at);
        }
    return out;
}

void read(Board& b, std::istream& in) {
    std::string line, word;
    std::map<int, int> wanted; /* net: class */
    int ground = 0, ground_class = 0;
    while (std::getline(in, line)) {
        std::istringstream s(line);
        s >> word;
        if (word == "board") s >> b.width >> b.height >> b.pitch >> b.clearance >> b.via >> b.edge;
        if (word == "class") { double w; s >> w; b.classes.push_back(w); }
        if (word == "pad") { Pad p{}; int t; s >> p.net >> p.layers >> p.x >> p.y >> p.w >> p.h >> t; p.through = t; b.pads.push_back(p); }
        if (word == "block") { std::array<double, 5> k{}; for (double& v : k) s >> v; b.blocks.push_back(k); }
        if (word == "rail") { Rail l{}; s >> l.net >> l.layer >> l.w >> l.x1 >> l.y1 >> l.x2 >> l.y2; b.rails.push_back(l); }
        if (word == "net") { int n, c; s >> n >> c; wanted[n] = c; }
        if (word == "ground") s >> ground >> ground_class;
    }
    b.nx = int(b.width / b.pitch) + 1;
    b.ny = int(b.height / b.pitch) + 1;
    std::map<int, std::vector<int>> pads;
    for (size_t k = 0; k < b.pads.size(); k++) pads[b.pads[k].net].push_back(int(k));
    for (auto [n, c] : wanted) b.jobs.push_back({n, c, false, pads[n], {}, {}});
    for (int k : pads[ground])
        if (!b.pads[size_t(k)].through) b.jobs.push_back({ground, ground_class, true, {k}, {}, {}});
    auto span = [&](const Job& j) {
        double x0 = 1e9, x1 = -1e9, y0 = 1e9, y1 = -1e9;
        for (int k : j.pads) { const Pad& p = b.pads[size_t(k)]; x0 = std::min(x0, p.x); x1 = std::max(x1, p.x); y0 = std::min(y0, p.y); y1 = std::max(y1, p.y); }
        return x1 - x0 + y1 - y0;
    };
    std::stable_sort(b.jobs.begin(), b.jobs.end(), [&](const Job& p, const Job& q) { return span(p) < span(q); });
}

void write(const Board& b) {
    auto x = [&](int at) { return (at % b.nx) * b.pitch; };
    auto y = [&](int at) { return (at / b.nx) * b.pitch; };
    std::set<std::pair<int, int>> holes;
    for (const Job& job : b.jobs)
        for (const auto& path : job.paths)
            for (size_t k = 0; k + 1 < path.size();) {
                if (path[k].layer != path[k + 1].layer && !holes.insert({job.net, path[k].at}).second) { k++; continue; }
                if (path[k].layer != path[k + 1].layer) { std::printf("via %d %.3f %.3f\n", job.net, x(path[k].at), y(path[k].at)); k++; continue; }
                size_t end = k + 1;
                int step = path[end].at - path[k].at;
                while (end + 1 < path.size() && path[end + 1].layer == path[k].layer && path[end + 1].at - path[end].at == step) end++;
                std::printf("track %d %d %.3f %.3f %.3f %.3f %.3f\n", job.net, path[k].layer, b.classes[size_t(job.cls)], x(path[k].at), y(path[k].at), x(path[end].at), y(path[end].at));
                k = end;
            }
}

} // namespace

int main() {
    Board b;
    read(b, std::cin);
    keep_out(b);
    size_t cells = size_t(b.nx) * b.ny;
    b.used.assign(size_t(b.maps()), std::vector<uint8_t>(cells, 0));
    b.mark.assign(size_t(b.maps()), std::vector<uint32_t>(cells, 0));
    b.past.assign(cells, 0);
    b.drilled.assign(cells, 0);
    Search search(b);
    size_t clashing = 0, lost = 0;
    for (int round = 0; round < ROUNDS; round++) {
        double pressure = 0.5 * std::pow(1.3, std::min(round, 30));
        lost = 0;
        for (Job& job : b.jobs) {
            if (round && !job.paths.empty() && clashes(b, job).empty()) continue;
            unstamp(b, job);
            if (!route(b, search, job, pressure)) {
                const Pad& p = b.pads[size_t(job.pads[0])];
                if (!round) std::fprintf(stderr, "no way for net %d, from %.2f %.2f\n", job.net, p.x, p.y);
                lost++;
            }
            stamp(b, job);
        }
        clashing = 0;
        for (Job& job : b.jobs) {
            auto bad = clashes(b, job);
            clashing += !bad.empty();
            for (int c : bad) b.past[size_t(c)] += 0.3F;
        }
        std::fprintf(stderr, "round %d: %zu of %zu nets too near, %zu without a way\n", round, clashing, b.jobs.size(), lost);
        if (!clashing) break;
    }
    write(b);
    return clashing || lost ? 1 : 0;
}
