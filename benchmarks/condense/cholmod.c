/* Condensation by CHOLMOD: its own METIS order of the matrix, supernodal L L^T, flexibility by back-solves of unit forces in batches. */
#include "matrix.h"
#include <string.h>
#include <suitesparse/cholmod.h>

int main(int argc, char **argv) {
    if (argc != 2) return 2;
    matrix m = read_matrix(argv[1]);
    cholmod_common c;
    cholmod_l_start(&c);
    c.supernodal = CHOLMOD_SUPERNODAL;
    c.final_ll = 1;
    c.nmethods = 1;
    c.method[0].ordering = CHOLMOD_METIS;
    c.postorder = 1;
    cholmod_sparse a;
    memset(&a, 0, sizeof a);
    a.nrow = a.ncol = (size_t)m.n, a.nzmax = (size_t)m.entries;
    a.p = m.offsets, a.i = m.rows, a.x = m.values;
    a.stype = -1, a.itype = CHOLMOD_LONG, a.xtype = CHOLMOD_REAL, a.dtype = CHOLMOD_DOUBLE;
    a.sorted = a.packed = 1;
    start();
    cholmod_factor *l = cholmod_l_analyze(&a, &c);
    lap("order"); /* ordering and symbolic analysis together */
    printf("symbolic_wall 0\nsymbolic_cpu 0\n");
    cholmod_l_factorize(&a, l, &c);
    if (c.status != CHOLMOD_OK) return 1;
    lap("factor");
    const size_t batch = 64;
    double trace = 0.0;
    cholmod_dense *x = NULL, *y = NULL, *e = NULL;
    for (size_t first = 0; first < (size_t)m.contact; first += batch) {
        size_t count = (size_t)m.contact - first < batch ? (size_t)m.contact - first : batch;
        cholmod_dense *b = cholmod_l_zeros((size_t)m.n, count, CHOLMOD_REAL, &c);
        for (size_t j = 0; j < count; j++) ((double *)b->x)[j * (size_t)m.n + (size_t)m.contact_rows[first + j]] = 1.0;
        cholmod_l_solve2(CHOLMOD_A, l, b, NULL, &x, NULL, &y, &e, &c);
        for (size_t j = 0; j < count; j++) trace += ((double *)x->x)[j * (size_t)m.n + (size_t)m.contact_rows[first + j]];
        cholmod_l_free_dense(&b, &c);
        if (first + count == (size_t)m.contact || (size_t)m.contact - first - count < batch) {
            cholmod_l_free_dense(&x, &c);
            cholmod_l_free_dense(&y, &c);
            cholmod_l_free_dense(&e, &c);
        }
    }
    lap("flexibility");
    printf("unknowns %ld\ncontact %ld\nentries %.0f\nflops %.6e\ntrace %.15e\n", (long)m.n, (long)m.contact, c.lnz, c.fl, trace);
    print_peak();
    return 0;
}
