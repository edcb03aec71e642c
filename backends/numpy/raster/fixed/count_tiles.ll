; Sources 2639d72187b2918dbff16475bd51279b01cbd8b80833b084118f22b0e69242ce
; Made by `python -m passgraph.backends.numpy.raster.generate`.

define internal i32 @count_tiles(ptr noalias %retptr, ptr noalias %excinfo, i64 %arg.first, i64 %arg.last, i64 %arg.chunk, ptr noalias %arg.ready.0, ptr noalias %arg.ready.1, i64 %arg.ready.2, i64 %arg.ready.3, ptr noalias %arg.ready.4, i64 %arg.ready.5.0, i64 %arg.ready.5.1, i64 %arg.ready.6.0, i64 %arg.ready.6.1, i64 %arg.tiles_x, ptr noalias %arg.counts.0, ptr noalias %arg.counts.1, i64 %arg.counts.2, i64 %arg.counts.3, ptr noalias %arg.counts.4, i64 %arg.counts.5.0, i64 %arg.counts.5.1, i64 %arg.counts.6.0, i64 %arg.counts.6.1) {
entry:
  %.78 = sub i64 %arg.last, %arg.first
  %.123259.not = icmp slt i64 %.78, 1
  br i1 %.123259.not, label %B306, label %B36.if.lr.ph

B36.if.lr.ph:
  %.814 = icmp slt i64 %arg.chunk, 0
  %.815 = select i1 %.814, i64 %arg.counts.5.0, i64 0
  %.816 = add i64 %.815, %arg.chunk
  %.836 = mul i64 %.816, %arg.counts.5.1
  %0 = getelementptr i64, ptr %arg.counts.4, i64 %.836
  br label %B36.if

B36.loopexit:
  %.123 = icmp sgt i64 %.68.0261, 1
  br i1 %.123, label %B36.if, label %B306

B142.loopexit:
  %.436 = icmp ugt i64 %.383.0258, 1
  br i1 %.436, label %B142.if, label %B36.loopexit

B306:
  store ptr null, ptr %retptr, align 8
  ret i32 0

B36.if:
  %.68.0261 = phi i64 [ %.78, %B36.if.lr.ph ], [ %.132, %B36.loopexit ]
  %.65.0260 = phi i64 [ %arg.first, %B36.if.lr.ph ], [ %.136, %B36.loopexit ]
  %.132 = add nsw i64 %.68.0261, -1
  %.136 = add i64 %.65.0260, 1
  %.191 = icmp slt i64 %.65.0260, 0
  %.192 = select i1 %.191, i64 %arg.ready.5.0, i64 0
  %.193 = add i64 %.192, %.65.0260
  %.213 = mul i64 %.193, %arg.ready.5.1
  %1 = getelementptr i32, ptr %arg.ready.4, i64 %.213
  %.217 = getelementptr i8, ptr %1, i64 20
  %.218 = load i32, ptr %.217, align 4
  %.219 = sext i32 %.218 to i64
  %.238247 = sdiv i32 %.218, 64
  %.238.sext = sext i32 %.238247 to i64
  %2 = and i64 %.219, -9223372036854775745
  %.241 = icmp ugt i64 %2, -9223372036854775808
  %.248 = sext i1 %.241 to i64
  %.227.0 = add nsw i64 %.248, %.238.sext
  %.313 = getelementptr i8, ptr %1, i64 28
  %.314 = load i32, ptr %.313, align 4
  %.315 = sext i32 %.314 to i64
  %.334248 = sdiv i32 %.314, 64
  %.334.sext = sext i32 %.334248 to i64
  %3 = and i64 %.315, -9223372036854775745
  %.337 = icmp ult i64 %3, -9223372036854775807
  %4 = zext i1 %.337 to i64
  %.323.0 = add nsw i64 %4, %.334.sext
  %.393 = sub nsw i64 %.323.0, %.227.0
  %.436256.not = icmp slt i64 %.393, 1
  br i1 %.436256.not, label %B36.loopexit, label %B142.if.lr.ph

B142.if.lr.ph:
  %.530 = getelementptr i8, ptr %1, i64 16
  %.531 = load i32, ptr %.530, align 4
  %.532 = sext i32 %.531 to i64
  %.551249 = sdiv i32 %.531, 64
  %.551.sext = sext i32 %.551249 to i64
  %5 = and i64 %.532, -9223372036854775745
  %.554 = icmp ugt i64 %5, -9223372036854775808
  %.561 = sext i1 %.554 to i64
  %.540.0 = add nsw i64 %.561, %.551.sext
  %.626 = getelementptr i8, ptr %1, i64 24
  %.627 = load i32, ptr %.626, align 4
  %.628 = sext i32 %.627 to i64
  %.647250 = sdiv i32 %.627, 64
  %.647.sext = sext i32 %.647250 to i64
  %6 = and i64 %.628, -9223372036854775745
  %.650 = icmp ult i64 %6, -9223372036854775807
  %7 = zext i1 %.650 to i64
  %.636.0 = add nsw i64 %7, %.647.sext
  %.706 = sub nsw i64 %.636.0, %.540.0
  %spec.select252 = tail call i64 @llvm.smax.i64(i64 %.706, i64 0)
  %.749253.not = icmp slt i64 %.706, 1
  br label %B142.if

B142.if:
  %.383.0258 = phi i64 [ %.393, %B142.if.lr.ph ], [ %.445, %B142.loopexit ]
  %.380.0257 = phi i64 [ %.227.0, %B142.if.lr.ph ], [ %.449, %B142.loopexit ]
  %.445 = add nsw i64 %.383.0258, -1
  %.449 = add nsw i64 %.380.0257, 1
  %8 = mul nsw i64 %.380.0257, %arg.tiles_x
  br i1 %.749253.not, label %B142.loopexit, label %B248.if

B248.if:
  %.696.0255 = phi i64 [ %.758, %B248.if ], [ %spec.select252, %B142.if ]
  %.693.0254 = phi i64 [ %.762, %B248.if ], [ %.540.0, %B142.if ]
  %.758 = add nsw i64 %.696.0255, -1
  %.762 = add nsw i64 %.693.0254, 1
  %.790 = add nsw i64 %.693.0254, %8
  %.817 = icmp slt i64 %.790, 0
  %.818 = select i1 %.817, i64 %arg.counts.5.1, i64 0
  %9 = getelementptr i64, ptr %0, i64 %.790
  %.840 = getelementptr i64, ptr %9, i64 %.818
  %.841 = load i64, ptr %.840, align 8
  %.842 = add nsw i64 %.841, 1
  store i64 %.842, ptr %.840, align 8
  %.749 = icmp sgt i64 %.696.0255, 1
  br i1 %.749, label %B248.if, label %B142.loopexit
}

declare i64 @llvm.smax.i64(i64, i64)
