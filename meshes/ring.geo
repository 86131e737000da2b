// A ring one element thick (0 <= y <= 1) about the y axis, of second order. Equal cells around and along the radius. Lengths in mm.
//
//   gmsh -3 ring.geo -format msh22 -bin -setnumber outward 1 -setnumber inner 15 -setnumber outer 25.02 -o press-fit-shaft.msh
//
// Groups: "contact" (the inner cylinder, or the outer one if outward = 1), "other" (the opposite cylinder), "base" (y = 0), "x0" and
// "z0" (the lines at x = 0 and at z = 0 of the cylinder "other"); volume "body".

DefineConstant[
  outward = {0, Name "outward"},             // 0 contact on the inner cylinder, 1 on the outer one
  inner = {25, Name "inner"},                // radius of the inner cylinder
  outer = {40, Name "outer"},                // radius of the outer cylinder
  around = {48, Name "around"},              // cells around
  across = {3, Name "across"}                // cells along the radius
];

Mesh.ElementOrder = 2;
Mesh.SecondOrderIncomplete = 1;

Point(1) = {0, 0, -inner};
line[] = Extrude {0, 0, inner - outer} { Point{1}; Layers{across}; };
curve = line[1];
contact[] = {};
other[] = {};
base[] = {};
volumes[] = {};
For quarter In {0:3}
  made[] = Extrude {{0, 1, 0}, {0, 0, 0}, -Pi / 2} { Curve{curve}; Layers{around / 4}; Recombine; };
  curve = made[0];
  base[] += made[1];
  thick[] = Extrude {0, 1, 0} { Surface{made[1]}; Layers{1}; Recombine; };
  volumes[] += thick[1];
EndFor
Coherence;
contact_radius = (outward == 1) ? outer : inner;
other_radius = (outward == 1) ? inner : outer;
e = 1e-3 * inner;
sides[] = Abs(CombinedBoundary { Volume{volumes[]}; });
For i In {0:#sides[] - 1}
  box[] = BoundingBox Surface { sides[i] };
  reach = Max(Max(Abs(box[0]), Abs(box[3])), Max(Abs(box[2]), Abs(box[5])));
  If (box[4] - box[1] > 0.5 && Abs(reach - contact_radius) < e)
    contact[] += sides[i];
  ElseIf (box[4] - box[1] > 0.5)
    other[] += sides[i];
  EndIf
EndFor
x0[] = {};
z0[] = {};
lines[] = Abs(Boundary { Surface{other[]}; });
For i In {0:#lines[] - 1}
  box[] = BoundingBox Curve { lines[i] };
  If (box[4] - box[1] > 0.5 && Abs(box[0]) < e)
    x0[] += lines[i];
  ElseIf (box[4] - box[1] > 0.5)
    z0[] += lines[i];
  EndIf
EndFor
Physical Surface("contact", 1) = contact[];
Physical Surface("other", 2) = other[];
Physical Surface("base", 3) = base[];
Physical Curve("x0", 4) = x0[];
Physical Curve("z0", 5) = z0[];
Physical Volume("body", 6) = volumes[];
