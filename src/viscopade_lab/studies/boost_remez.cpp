#include <boost/function.hpp>
#include <boost/math/tools/remez.hpp>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <chrono>
#include <fstream>
#include <iostream>
#include <sstream>
using namespace boost::multiprecision;
typedef number<cpp_bin_float<40>, et_off> T;
struct Row { int e; std::vector<T> a; };
static std::vector<Row> rows;
static T epsilon(T const& v) {  // the rows of data/double.txt
    int exponent, index = 0;
    double mantissa = std::frexp((double)v, &exponent);
    T centre = 0, half = std::ldexp(1.0, FIRST);
    if (exponent - 1 >= FIRST && v > 0) {
        int part = (int)((2 * mantissa - 1) * (1 << SPLIT));
        index = 1 + ((exponent - 1 - FIRST) << SPLIT) + part;
        half = std::ldexp(1.0, exponent - 2 - SPLIT);
        centre = std::ldexp(1.0, exponent - 1) + half * (2 * part + 1);
    }
    T z = (v - centre) / half, total = 0;
    for (int i = (int)rows[index].a.size() - 1; i >= 0; --i) total = total * z + rows[index].a[i];
    return ldexp(total, rows[index].e);
}
int main(int, char** argv) {
    std::ifstream file(argv[1]);
    for (std::string line; std::getline(file, line);) {
        std::istringstream words(line);
        std::string name, number;
        int index; Row row;
        if (!(words >> name >> index >> row.e) || name != "epsilon") continue;
        while (words >> number) row.a.push_back(T(number));
        rows.push_back(row);
    }
    unsigned m, n; double v; int brake;
    while (std::cin >> m >> n >> v >> brake) {
        auto start = std::chrono::steady_clock::now();
        std::ostringstream out;
        out.precision(25);
        try {
            boost::math::tools::remez_minimax<T> remez(epsilon, m, n, T(0), T(v), false, true);
            remez.set_brake(brake);
            for (int i = 0; i < 60; ++i) {
                remez.iterate();
                if (fabs(remez.max_error()) - fabs(remez.error_term()) < 1e-6 * fabs(remez.max_error())) break;
            }
            for (unsigned i = 0; i <= m; ++i) out << " " << remez.numerator()[i];
            for (unsigned i = 0; i <= n; ++i) out << " " << remez.denominator()[i];
        } catch (std::exception const&) { out.str(""); }
        std::cout << "@ " << std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()
                  << out.str() << std::endl;
    }
}
