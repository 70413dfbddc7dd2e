%
(circular groove, diameter 50 mm, cut counter-clockwise)
(the program origin is the centre of the circle, on the floor of the groove)
N10 G21 G90 G17 G94
(the tool is in the spindle)
N30 S8000 M3
N40 G0 X25 Y0 Z5
N50 G1 Z0 F300
N60 G3 X25 Y0 I-25 J0 F600
N70 G1 Z5 F1000
N80 M5
N90 M30
%
