%
(inches, numbers, blank lines, small letters)
N10 g20 g90 g17 g94
N20 g61 ; exact path
N30 S8000 M3

n40 g0 x1.0 y0
n50 z.2
N60 G1 Z-.04 F16 (feed of inches a minute)
N70 g3 x-1. y0 i-1. j0 f60.
N80 x1. i1.

N90 G2 X0 Y-1 R1.
(the rest the other way round)
N100 g2 x1.0 y0 r-1.0
N110 G0 Z.4
N120 G21 X-10 Y10
N130 G1 Z-2 F500
N140 G2 X-10 Y10 I8 J-6 F1500
N150 G0 Z10
N160 M5
N170 M30
%
