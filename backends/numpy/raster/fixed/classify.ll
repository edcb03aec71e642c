; Sources 2639d72187b2918dbff16475bd51279b01cbd8b80833b084118f22b0e69242ce
; Made by `python -m passgraph.backends.numpy.raster.generate`.

define internal i32 @classify(ptr noalias %retptr, ptr noalias %excinfo, i64 %arg.first, i64 %arg.last, i64 %arg.chunk, ptr noalias %arg.triangles.0, ptr noalias %arg.triangles.1, i64 %arg.triangles.2, i64 %arg.triangles.3, ptr noalias %arg.triangles.4, i64 %arg.triangles.5.0, i64 %arg.triangles.5.1, i64 %arg.triangles.6.0, i64 %arg.triangles.6.1, ptr noalias %arg.codes.0, ptr noalias %arg.codes.1, i64 %arg.codes.2, i64 %arg.codes.3, ptr noalias %arg.codes.4, i64 %arg.codes.5.0, i64 %arg.codes.6.0, ptr noalias %arg.kinds.0, ptr noalias %arg.kinds.1, i64 %arg.kinds.2, i64 %arg.kinds.3, ptr noalias %arg.kinds.4, i64 %arg.kinds.5.0, i64 %arg.kinds.6.0, ptr noalias %arg.counts.0, ptr noalias %arg.counts.1, i64 %arg.counts.2, i64 %arg.counts.3, ptr noalias %arg.counts.4, i64 %arg.counts.5.0, i64 %arg.counts.5.1, i64 %arg.counts.6.0, i64 %arg.counts.6.1) {
entry:
  %.103 = sub i64 %arg.last, %arg.first
  %.148291.not = icmp slt i64 %.103, 1
  br i1 %.148291.not, label %B326, label %B44.if

B176:
  %.471 = or i64 %.459, %.458
  %.474 = or i64 %.471, %.462
  %.476.not = icmp ult i64 %.474, 128
  br i1 %.476.not, label %B230, label %B208

B208:
  %.511 = select i1 %.216, i64 %arg.kinds.5.0, i64 0
  %0 = getelementptr i8, ptr %arg.kinds.4, i64 %.90.0292
  %.525 = getelementptr i8, ptr %0, i64 %.511
  store i8 0, ptr %.525, align 1
  br label %B327

B230:
  %.545 = and i64 %.474, 67
  %.546.not = icmp eq i64 %.545, 0
  %.614 = select i1 %.216, i64 %arg.kinds.5.0, i64 0
  %1 = getelementptr i8, ptr %arg.kinds.4, i64 %.90.0292
  %.628 = getelementptr i8, ptr %1, i64 %.614
  br i1 %.546.not, label %B294, label %B262

B262:
  store i8 2, ptr %.628, align 1
  %.588 = add nsw i64 %clipped.2.0295, 1
  br label %B327

B294:
  store i8 1, ptr %.628, align 1
  %.634 = add nsw i64 %direct.2.0294, 1
  br label %B327

B326:
  %direct.2.0.lcssa = phi i64 [ 0, %entry ], [ %direct.3.1, %B327 ]
  %clipped.2.0.lcssa = phi i64 [ 0, %entry ], [ %clipped.3.1, %B327 ]
  %.678 = icmp slt i64 %arg.chunk, 0
  %.679 = select i1 %.678, i64 %arg.counts.5.0, i64 0
  %.680 = add i64 %.679, %arg.chunk
  %.700 = mul i64 %.680, %arg.counts.5.1
  %.704 = getelementptr i64, ptr %arg.counts.4, i64 %.700
  store i64 %direct.2.0.lcssa, ptr %.704, align 8
  %.764 = getelementptr i8, ptr %.704, i64 8
  store i64 %clipped.2.0.lcssa, ptr %.764, align 8
  store ptr null, ptr %retptr, align 8
  ret i32 0

B327:
  %direct.3.1 = phi i64 [ %direct.2.0294, %B208 ], [ %direct.2.0294, %B262 ], [ %.634, %B294 ]
  %clipped.3.1 = phi i64 [ %clipped.2.0295, %B208 ], [ %.588, %B262 ], [ %clipped.2.0295, %B294 ]
  %.148 = icmp ugt i64 %.93.0293, 1
  br i1 %.148, label %B44.if, label %B326

B44.if:
  %clipped.2.0295 = phi i64 [ %clipped.3.1, %B327 ], [ 0, %entry ]
  %direct.2.0294 = phi i64 [ %direct.3.1, %B327 ], [ 0, %entry ]
  %.93.0293 = phi i64 [ %.157, %B327 ], [ %.103, %entry ]
  %.90.0292 = phi i64 [ %.161, %B327 ], [ %arg.first, %entry ]
  %.157 = add nsw i64 %.93.0293, -1
  %.161 = add i64 %.90.0292, 1
  %.216 = icmp slt i64 %.90.0292, 0
  %.217 = select i1 %.216, i64 %arg.triangles.5.0, i64 0
  %.218 = add i64 %.217, %.90.0292
  %.238 = mul i64 %.218, %arg.triangles.5.1
  %.242 = getelementptr i32, ptr %arg.triangles.4, i64 %.238
  %.243 = load i32, ptr %.242, align 4
  %.245 = sext i32 %.243 to i64
  %.258 = icmp slt i32 %.243, 0
  %.259 = select i1 %.258, i64 %arg.codes.5.0, i64 0
  %2 = getelementptr i8, ptr %arg.codes.4, i64 %.259
  %.273 = getelementptr i8, ptr %2, i64 %.245
  %.274 = load i8, ptr %.273, align 1
  %.328 = getelementptr i8, ptr %.242, i64 4
  %.329 = load i32, ptr %.328, align 4
  %.331 = sext i32 %.329 to i64
  %.344 = icmp slt i32 %.329, 0
  %.345 = select i1 %.344, i64 %arg.codes.5.0, i64 0
  %3 = getelementptr i8, ptr %arg.codes.4, i64 %.345
  %.359 = getelementptr i8, ptr %3, i64 %.331
  %.360 = load i8, ptr %.359, align 1
  %.414 = getelementptr i8, ptr %.242, i64 8
  %.415 = load i32, ptr %.414, align 4
  %.417 = sext i32 %.415 to i64
  %.430 = icmp slt i32 %.415, 0
  %.431 = select i1 %.430, i64 %arg.codes.5.0, i64 0
  %4 = getelementptr i8, ptr %arg.codes.4, i64 %.431
  %.445 = getelementptr i8, ptr %4, i64 %.417
  %.446 = load i8, ptr %.445, align 1
  %.458 = zext i8 %.274 to i64
  %.459 = zext i8 %.360 to i64
  %.462 = zext i8 %.446 to i64
  %.460 = and i64 %.458, 63
  %.463 = and i64 %.460, %.459
  %.464 = and i64 %.463, %.462
  %.465.not = icmp eq i64 %.464, 0
  br i1 %.465.not, label %B176, label %B208
}
