// Macro shared by the scripts: the ratio of a geometric progression.
//
// In: progression_first (first cell), progression_cells, progression_length.
// Out: progression_ratio with first (1 + ratio + .. + ratio^(cells - 1)) = length, by bisection;
//      progression_heights[]: ends of the cells as fractions of the length, progression_ones[]: as many ones.
Macro Progression
  progression_low = 0.01;
  progression_high = 100;
  For step In {1:200}
    progression_ratio = Sqrt(progression_low * progression_high);
    progression_sum = 0;
    For cell In {0:progression_cells - 1}
      progression_sum += progression_first * progression_ratio^cell;
    EndFor
    If (progression_sum < progression_length)
      progression_low = progression_ratio;
    Else
      progression_high = progression_ratio;
    EndIf
  EndFor
  progression_heights[] = {};
  progression_ones[] = {};
  progression_end = 0;
  For cell In {0:progression_cells - 1}
    progression_end += progression_first * progression_ratio^cell / progression_sum;
    progression_heights[] += (cell == progression_cells - 1) ? 1 : progression_end;
    progression_ones[] += 1;
  EndFor
Return
