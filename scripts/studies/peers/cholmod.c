/* Times CHOLMOD's supernodal factor and solve for a matrix that standard input gives: n, the column pointers of its upper
   triangle, the rows, the values, in 64-bit numbers. Prints one line of JSON; times are the best of several. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <suitesparse/cholmod.h>

enum { FACTORS = 20, SOLVES = 50 };

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void *numbers(size_t count) {
    void *data = malloc(8 * count);
    if (!data || fread(data, 8, count, stdin) != count) {
        fprintf(stderr, "cholmod.c: the matrix ends early\n");
        exit(1);
    }
    return data;
}

int main(void) {
    int64_t n = *(int64_t *)numbers(1), *begin = numbers((size_t)n + 1);
    int64_t *rows = numbers((size_t)begin[n]);
    double *values = numbers((size_t)begin[n]);
    cholmod_common common;
    cholmod_l_start(&common);
    common.supernodal = CHOLMOD_SUPERNODAL;
    cholmod_sparse *a = cholmod_l_allocate_sparse(n, n, begin[n], 1, 1, 1, CHOLMOD_REAL, &common);
    memcpy(a->p, begin, 8 * ((size_t)n + 1));
    memcpy(a->i, rows, 8 * (size_t)begin[n]);
    memcpy(a->x, values, 8 * (size_t)begin[n]);
    /* Orders by minimum degree and by METIS, and takes the better one. */
    cholmod_factor *l = cholmod_l_analyze(a, &common);
    cholmod_dense *b = cholmod_l_ones(n, 1, CHOLMOD_REAL, &common), *x = NULL, *y = NULL, *e = NULL;
    double factor = 1e9, solve = 1e9;
    for (int k = 0; k < FACTORS; k++) {
        double start = now();
        cholmod_l_factorize(a, l, &common);
        if (now() - start < factor) factor = now() - start;
    }
    if (common.status != CHOLMOD_OK) {
        fprintf(stderr, "cholmod.c: status %d\n", common.status);
        return 1;
    }
    for (int k = 0; k < SOLVES; k++) {
        double start = now();
        cholmod_l_solve2(CHOLMOD_A, l, b, NULL, &x, NULL, &y, &e, &common);
        if (now() - start < solve) solve = now() - start;
    }
    printf("{\"kind\": \"cholmod\", \"dofs\": %ld, \"length\": %ld, \"flops\": %.4e, \"factor\": %.4e, \"solve\": %.4e}\n",
           (long)n, (long)l->xsize, common.fl, factor, solve);
    cholmod_l_free_dense(&b, &common);
    cholmod_l_free_dense(&x, &common);
    cholmod_l_free_dense(&y, &common);
    cholmod_l_free_dense(&e, &common);
    cholmod_l_free_factor(&l, &common);
    cholmod_l_free_sparse(&a, &common);
    cholmod_l_finish(&common);
    return 0;
}
