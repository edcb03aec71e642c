; Sources 2639d72187b2918dbff16475bd51279b01cbd8b80833b084118f22b0e69242ce
; Made by `python -m passgraph.backends.numpy.raster.generate`.

define internal i32 @fill_tiles(ptr noalias %retptr, ptr noalias %excinfo, i64 %arg.first, i64 %arg.last, i64 %arg.chunk, ptr noalias %arg.ready.0, ptr noalias %arg.ready.1, i64 %arg.ready.2, i64 %arg.ready.3, ptr noalias %arg.ready.4, i64 %arg.ready.5.0, i64 %arg.ready.5.1, i64 %arg.ready.6.0, i64 %arg.ready.6.1, i64 %arg.tiles_x, ptr noalias %arg.cursors.0, ptr noalias %arg.cursors.1, i64 %arg.cursors.2, i64 %arg.cursors.3, ptr noalias %arg.cursors.4, i64 %arg.cursors.5.0, i64 %arg.cursors.5.1, i64 %arg.cursors.6.0, i64 %arg.cursors.6.1, ptr noalias %arg.lists.0, ptr noalias %arg.lists.1, i64 %arg.lists.2, i64 %arg.lists.3, ptr noalias %arg.lists.4, i64 %arg.lists.5.0, i64 %arg.lists.6.0) {
entry:
  %.89 = sub i64 %arg.last, %arg.first
  %.134300.not = icmp slt i64 %.89, 1
  br i1 %.134300.not, label %B336, label %B36.if.lr.ph

B36.if.lr.ph:
  %.825 = icmp slt i64 %arg.chunk, 0
  %.826 = select i1 %.825, i64 %arg.cursors.5.0, i64 0
  %.827 = add i64 %.826, %arg.chunk
  %.847 = mul i64 %.827, %arg.cursors.5.1
  %0 = getelementptr i64, ptr %arg.cursors.4, i64 %.847
  br label %B36.if

B36.loopexit:
  %.134 = icmp sgt i64 %.79.0302, 1
  br i1 %.134, label %B36.if, label %B336

B142.loopexit:
  %.447 = icmp ugt i64 %.394.0299, 1
  br i1 %.447, label %B142.if, label %B36.loopexit

B336:
  store ptr null, ptr %retptr, align 8
  ret i32 0

B36.if:
  %.79.0302 = phi i64 [ %.89, %B36.if.lr.ph ], [ %.143, %B36.loopexit ]
  %.76.0301 = phi i64 [ %arg.first, %B36.if.lr.ph ], [ %.147, %B36.loopexit ]
  %.143 = add nsw i64 %.79.0302, -1
  %.147 = add i64 %.76.0301, 1
  %.202 = icmp slt i64 %.76.0301, 0
  %.203 = select i1 %.202, i64 %arg.ready.5.0, i64 0
  %.204 = add i64 %.203, %.76.0301
  %.224 = mul i64 %.204, %arg.ready.5.1
  %1 = getelementptr i32, ptr %arg.ready.4, i64 %.224
  %.228 = getelementptr i8, ptr %1, i64 20
  %.229 = load i32, ptr %.228, align 4
  %.230 = sext i32 %.229 to i64
  %.249288 = sdiv i32 %.229, 64
  %.249.sext = sext i32 %.249288 to i64
  %2 = and i64 %.230, -9223372036854775745
  %.252 = icmp ugt i64 %2, -9223372036854775808
  %.259 = sext i1 %.252 to i64
  %.238.0 = add nsw i64 %.259, %.249.sext
  %.324 = getelementptr i8, ptr %1, i64 28
  %.325 = load i32, ptr %.324, align 4
  %.326 = sext i32 %.325 to i64
  %.345289 = sdiv i32 %.325, 64
  %.345.sext = sext i32 %.345289 to i64
  %3 = and i64 %.326, -9223372036854775745
  %.348 = icmp ult i64 %3, -9223372036854775807
  %4 = zext i1 %.348 to i64
  %.334.0 = add nsw i64 %4, %.345.sext
  %.404 = sub nsw i64 %.334.0, %.238.0
  %.447297.not = icmp slt i64 %.404, 1
  br i1 %.447297.not, label %B36.loopexit, label %B142.if.lr.ph

B142.if.lr.ph:
  %.541 = getelementptr i8, ptr %1, i64 16
  %.542 = load i32, ptr %.541, align 4
  %.543 = sext i32 %.542 to i64
  %.562290 = sdiv i32 %.542, 64
  %.562.sext = sext i32 %.562290 to i64
  %5 = and i64 %.543, -9223372036854775745
  %.565 = icmp ugt i64 %5, -9223372036854775808
  %.572 = sext i1 %.565 to i64
  %.551.0 = add nsw i64 %.572, %.562.sext
  %.637 = getelementptr i8, ptr %1, i64 24
  %.638 = load i32, ptr %.637, align 4
  %.639 = sext i32 %.638 to i64
  %.658291 = sdiv i32 %.638, 64
  %.658.sext = sext i32 %.658291 to i64
  %6 = and i64 %.639, -9223372036854775745
  %.661 = icmp ult i64 %6, -9223372036854775807
  %7 = zext i1 %.661 to i64
  %.647.0 = add nsw i64 %7, %.658.sext
  %.717 = sub nsw i64 %.647.0, %.551.0
  %spec.select293 = tail call i64 @llvm.smax.i64(i64 %.717, i64 0)
  %.760294.not = icmp slt i64 %.717, 1
  %.883 = trunc i64 %.76.0301 to i32
  br label %B142.if

B142.if:
  %.394.0299 = phi i64 [ %.404, %B142.if.lr.ph ], [ %.456, %B142.loopexit ]
  %.391.0298 = phi i64 [ %.238.0, %B142.if.lr.ph ], [ %.460, %B142.loopexit ]
  %.456 = add nsw i64 %.394.0299, -1
  %.460 = add nsw i64 %.391.0298, 1
  %8 = mul nsw i64 %.391.0298, %arg.tiles_x
  br i1 %.760294.not, label %B142.loopexit, label %B248.if

B248.if:
  %.707.0296 = phi i64 [ %.769, %B248.if ], [ %spec.select293, %B142.if ]
  %.704.0295 = phi i64 [ %.773, %B248.if ], [ %.551.0, %B142.if ]
  %.769 = add nsw i64 %.707.0296, -1
  %.773 = add nsw i64 %.704.0295, 1
  %.801 = add nsw i64 %.704.0295, %8
  %.828 = icmp slt i64 %.801, 0
  %.829 = select i1 %.828, i64 %arg.cursors.5.1, i64 0
  %9 = getelementptr i64, ptr %0, i64 %.801
  %.851 = getelementptr i64, ptr %9, i64 %.829
  %.852 = load i64, ptr %.851, align 8
  %.867 = icmp slt i64 %.852, 0
  %.868 = select i1 %.867, i64 %arg.lists.5.0, i64 0
  %10 = getelementptr i32, ptr %arg.lists.4, i64 %.852
  %.882 = getelementptr i32, ptr %10, i64 %.868
  store i32 %.883, ptr %.882, align 4
  %.936 = add nsw i64 %.852, 1
  store i64 %.936, ptr %.851, align 8
  %.760 = icmp sgt i64 %.707.0296, 1
  br i1 %.760, label %B248.if, label %B142.loopexit
}

declare i64 @llvm.smax.i64(i64, i64)
