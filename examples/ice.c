/* Two balls of ice at low temperature, as in the paper: from the impact speed and beta to eps, without a root. */
#include <stdio.h>
#include "viscopade_speed_1em5.h"

int main(void)
{
    double beta = 1.307; /* (s/cm)^(1/5) */
    double speed = 0.1;  /* cm/s; a negative one gives NaN: bodies that part */

    printf("eps = %.6f\n", viscopade_restitution_1em5(speed, beta));
    return 0;
}
