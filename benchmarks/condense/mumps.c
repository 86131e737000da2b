/* Condensation by MUMPS: METIS order of orthowear, Schur complement of the contact rows, inverse of the complement by LAPACK. */
#include "matrix.h"
#include <dmumps_c.h>
#include <string.h>

void dpotrf_(const char *, const int *, double *, const int *, int *);
void dpotri_(const char *, const int *, double *, const int *, int *);

#define ICNTL(i) icntl[(i) - 1]
#define INFOG(i) infog[(i) - 1]
#define RINFOG(i) rinfog[(i) - 1]

static DMUMPS_STRUC_C id;

static void call(int job) {
    id.job = job;
    dmumps_c(&id);
    if (id.INFOG(1) < 0) {
        fprintf(stderr, "MUMPS job %d: error %d, %d\n", job, id.INFOG(1), id.INFOG(2));
        exit(1);
    }
}

int main(int argc, char **argv) {
    if (argc != 2) return 2;
    matrix m = read_matrix(argv[1]);
    int *irn = malloc((size_t)m.entries * sizeof(int)), *jcn = malloc((size_t)m.entries * sizeof(int));
    for (int64_t j = 0; j < m.n; j++)
        for (int64_t k = m.offsets[j]; k < m.offsets[j + 1]; k++) irn[k] = (int)m.rows[k] + 1, jcn[k] = (int)j + 1;
    id.par = 1, id.sym = 1, id.comm_fortran = -987654;
    call(-1);
    id.ICNTL(1) = id.ICNTL(2) = id.ICNTL(3) = -1, id.ICNTL(4) = 0;
    id.n = (int)m.n, id.nnz = m.entries, id.irn = irn, id.jcn = jcn, id.a = m.values;
    int size = (int)m.contact;
    int *list = malloc((size_t)size * sizeof(int)), *perm = malloc((size_t)m.n * sizeof(int));
    for (int i = 0; i < size; i++) list[i] = (int)m.contact_rows[i] + 1;
    for (int64_t place = 0; place < m.n; place++) perm[m.order[place]] = (int)place + 1;
    double *schur = calloc((size_t)size * (size_t)size, sizeof(double));
    id.ICNTL(7) = 1, id.perm_in = perm;
    id.ICNTL(19) = 3; /* the whole symmetric Schur complement by columns, centralised */
    id.size_schur = size, id.listvar_schur = list, id.schur = schur, id.schur_lld = size;
    id.nprow = id.npcol = 1, id.mblock = id.nblock = 100;
    id.ICNTL(14) = 40;
    start();
    call(1);
    lap("symbolic"); /* The order is given; `compare` adds its time. */
    call(2);
    lap("factor");
    int info = 0;
    dpotrf_("L", &size, schur, &size, &info);
    if (info == 0) dpotri_("L", &size, schur, &size, &info);
    if (info != 0) return 1;
    double trace = 0.0;
    for (int i = 0; i < size; i++) trace += schur[(size_t)i * (size_t)size + (size_t)i];
    lap("flexibility");
    printf("unknowns %ld\ncontact %d\nentries %.0f\nflops %.6e\ntrace %.15e\n", (long)m.n, size,
           id.INFOG(20) < 0 ? -1e6 * id.INFOG(20) : (double)id.INFOG(20), id.RINFOG(3), trace);
    print_peak();
    return 0;
}
