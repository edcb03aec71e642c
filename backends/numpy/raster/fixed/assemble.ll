; Sources 2639d72187b2918dbff16475bd51279b01cbd8b80833b084118f22b0e69242ce
; Made by `python -m passgraph.backends.numpy.raster.generate`.

define internal i32 @assemble(ptr noalias %retptr, ptr noalias %excinfo, i64 %arg.first, i64 %arg.last, i64 %arg.chunk, i64 %arg.free, i64 %arg.at, ptr noalias %arg.triangles.0, ptr noalias %arg.triangles.1, i64 %arg.triangles.2, i64 %arg.triangles.3, ptr noalias %arg.triangles.4, i64 %arg.triangles.5.0, i64 %arg.triangles.5.1, i64 %arg.triangles.6.0, i64 %arg.triangles.6.1, ptr noalias %arg.kinds.0, ptr noalias %arg.kinds.1, i64 %arg.kinds.2, i64 %arg.kinds.3, ptr noalias %arg.kinds.4, i64 %arg.kinds.5.0, i64 %arg.kinds.6.0, ptr noalias %arg.codes.0, ptr noalias %arg.codes.1, i64 %arg.codes.2, i64 %arg.codes.3, ptr noalias %arg.codes.4, i64 %arg.codes.5.0, i64 %arg.codes.6.0, ptr noalias %arg.clip.0, ptr noalias %arg.clip.1, i64 %arg.clip.2, i64 %arg.clip.3, ptr noalias %arg.clip.4, i64 %arg.clip.5.0, i64 %arg.clip.5.1, i64 %arg.clip.6.0, i64 %arg.clip.6.1, ptr noalias %arg.varyings.0, ptr noalias %arg.varyings.1, i64 %arg.varyings.2, i64 %arg.varyings.3, ptr noalias %arg.varyings.4, i64 %arg.varyings.5.0, i64 %arg.varyings.5.1, i64 %arg.varyings.6.0, i64 %arg.varyings.6.1, i64 %arg.width, i64 %arg.height, i64 %arg.cull, ptr noalias %arg.window_x.0, ptr noalias %arg.window_x.1, i64 %arg.window_x.2, i64 %arg.window_x.3, ptr noalias %arg.window_x.4, i64 %arg.window_x.5.0, i64 %arg.window_x.6.0, ptr noalias %arg.window_y.0, ptr noalias %arg.window_y.1, i64 %arg.window_y.2, i64 %arg.window_y.3, ptr noalias %arg.window_y.4, i64 %arg.window_y.5.0, i64 %arg.window_y.6.0, ptr noalias %arg.depth.0, ptr noalias %arg.depth.1, i64 %arg.depth.2, i64 %arg.depth.3, ptr noalias %arg.depth.4, i64 %arg.depth.5.0, i64 %arg.depth.6.0, ptr noalias %arg.inverse_w.0, ptr noalias %arg.inverse_w.1, i64 %arg.inverse_w.2, i64 %arg.inverse_w.3, ptr noalias %arg.inverse_w.4, i64 %arg.inverse_w.5.0, i64 %arg.inverse_w.6.0, ptr noalias %arg.ready.0, ptr noalias %arg.ready.1, i64 %arg.ready.2, i64 %arg.ready.3, ptr noalias %arg.ready.4, i64 %arg.ready.5.0, i64 %arg.ready.5.1, i64 %arg.ready.6.0, i64 %arg.ready.6.1, ptr noalias %arg.corners.0, ptr noalias %arg.corners.1, i64 %arg.corners.2, i64 %arg.corners.3, ptr noalias %arg.corners.4, i64 %arg.corners.5.0, i64 %arg.corners.5.1, i64 %arg.corners.6.0, i64 %arg.corners.6.1) {
entry:
  %.205 = sub i64 %arg.last, %arg.first
  %.251684.not = icmp slt i64 %.205, 1
  br i1 %.251684.not, label %common.ret, label %B58.if.lr.ph

B58.if.lr.ph:
  %.165 = shl nsw i64 %arg.chunk, 1
  %.279.i = icmp slt i64 %arg.chunk, 0
  %.280.i = select i1 %.279.i, i64 %arg.corners.5.0, i64 0
  %.281.i = add i64 %.280.i, %.165
  %.301.i = mul i64 %.281.i, %arg.corners.5.1
  %0 = getelementptr i64, ptr %arg.corners.4, i64 %.301.i
  %.74.i = or i64 %.165, 1
  %.879.i = add i64 %.74.i, %.280.i
  %.899.i = mul i64 %.879.i, %arg.corners.5.1
  %1 = getelementptr i64, ptr %arg.corners.4, i64 %.899.i
  %.451223.not.i.i = icmp slt i64 %arg.varyings.5.1, 1
  %.666.i = sitofp i64 %arg.width to double
  %.780.i = sitofp i64 %arg.height to double
  %.287.i570 = icmp eq i64 %arg.cull, 2
  %.293.i574 = icmp eq i64 %arg.cull, 1
  %.537.i = add nsw i64 %arg.width, -1
  %.569.i = add nsw i64 %arg.height, -1
  br label %B58.if

B96:
  %.360 = select i1 %.306, i64 %arg.triangles.5.0, i64 0
  %.361 = add i64 %.360, %.192.0686
  %.381 = mul i64 %.361, %arg.triangles.5.1
  %.385 = getelementptr i32, ptr %arg.triangles.4, i64 %.381
  %.386 = load i32, ptr %.385, align 4
  %.440 = getelementptr i8, ptr %.385, i64 4
  %.441 = load i32, ptr %.440, align 4
  %.497 = getelementptr i8, ptr %.385, i64 8
  %.498 = load i32, ptr %.497, align 4
  tail call void @llvm.experimental.noalias.scope.decl(metadata !0)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !3)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !5)
  %.59.i = sext i32 %.386 to i64
  %.72.i = icmp slt i32 %.386, 0
  %.73.i = select i1 %.72.i, i64 %arg.window_x.5.0, i64 0
  %2 = getelementptr i32, ptr %arg.window_x.4, i64 %.73.i
  %.87.i = getelementptr i32, ptr %2, i64 %.59.i
  %.88.i = load i32, ptr %.87.i, align 4, !alias.scope !0, !noalias !7
  %.89.i = sext i32 %.88.i to i64
  %.105.i = select i1 %.72.i, i64 %arg.window_y.5.0, i64 0
  %3 = getelementptr i32, ptr %arg.window_y.4, i64 %.105.i
  %.119.i = getelementptr i32, ptr %3, i64 %.59.i
  %.120.i = load i32, ptr %.119.i, align 4, !alias.scope !3, !noalias !9
  %.121.i = sext i32 %.120.i to i64
  %.129.i = sext i32 %.441 to i64
  %.142.i = icmp slt i32 %.441, 0
  %.143.i = select i1 %.142.i, i64 %arg.window_x.5.0, i64 0
  %4 = getelementptr i32, ptr %arg.window_x.4, i64 %.143.i
  %.157.i = getelementptr i32, ptr %4, i64 %.129.i
  %.158.i = load i32, ptr %.157.i, align 4, !alias.scope !0, !noalias !7
  %.159.i = sext i32 %.158.i to i64
  %.175.i = select i1 %.142.i, i64 %arg.window_y.5.0, i64 0
  %5 = getelementptr i32, ptr %arg.window_y.4, i64 %.175.i
  %.189.i = getelementptr i32, ptr %5, i64 %.129.i
  %.190.i = load i32, ptr %.189.i, align 4, !alias.scope !3, !noalias !9
  %.191.i = sext i32 %.190.i to i64
  %.199.i = sext i32 %.498 to i64
  %.212.i = icmp slt i32 %.498, 0
  %.213.i = select i1 %.212.i, i64 %arg.window_x.5.0, i64 0
  %6 = getelementptr i32, ptr %arg.window_x.4, i64 %.213.i
  %.227.i = getelementptr i32, ptr %6, i64 %.199.i
  %.228.i = load i32, ptr %.227.i, align 4, !alias.scope !0, !noalias !7
  %.229.i = sext i32 %.228.i to i64
  %.245.i = select i1 %.212.i, i64 %arg.window_y.5.0, i64 0
  %7 = getelementptr i32, ptr %arg.window_y.4, i64 %.245.i
  %.259.i = getelementptr i32, ptr %7, i64 %.199.i
  %.260.i = load i32, ptr %.259.i, align 4, !alias.scope !3, !noalias !9
  %.261.i = sext i32 %.260.i to i64
  %.270.i = sub nsw i64 %.159.i, %.89.i
  %.273.i = sub nsw i64 %.261.i, %.121.i
  %.274.i = mul nsw i64 %.273.i, %.270.i
  %.277.i = sub nsw i64 %.229.i, %.89.i
  %.280.neg.i = sub nsw i64 %.121.i, %.191.i
  %.281.neg.i = mul i64 %.277.i, %.280.neg.i
  %.282.i = add i64 %.274.i, %.281.neg.i
  %.287.i = icmp eq i64 %.282.i, 0
  br i1 %.287.i, label %B599, label %B374.i

B374.i:
  %.290.i = icmp slt i64 %.282.i, 0
  %or.cond.i = select i1 %.290.i, i1 %.287.i570, i1 false
  %.296.i = icmp sgt i64 %.282.i, 0
  %or.cond458.i = select i1 %.296.i, i1 %.293.i574, i1 false
  %or.cond = select i1 %or.cond.i, i1 true, i1 %or.cond458.i
  br i1 %or.cond, label %B599, label %B426.i

B426.i:
  %.14.i.i = tail call i64 @llvm.smin.i64(i64 %.159.i, i64 %.89.i)
  %.16.i.i = tail call i64 @llvm.smin.i64(i64 %.229.i, i64 %.14.i.i)
  %.373.i = add nsw i64 %.16.i.i, 127
  %.374.i = ashr i64 %.373.i, 8
  %.14.i461.i = tail call i64 @llvm.smax.i64(i64 %.159.i, i64 %.89.i)
  %.16.i462.i = tail call i64 @llvm.smax.i64(i64 %.229.i, i64 %.14.i461.i)
  %.408.i = add nsw i64 %.16.i462.i, -128
  %.409.i = ashr i64 %.408.i, 8
  %.14.i463.i = tail call i64 @llvm.smin.i64(i64 %.191.i, i64 %.121.i)
  %.16.i464.i = tail call i64 @llvm.smin.i64(i64 %.261.i, i64 %.14.i463.i)
  %.443.i = add nsw i64 %.16.i464.i, 127
  %.444.i = ashr i64 %.443.i, 8
  %.14.i465.i = tail call i64 @llvm.smax.i64(i64 %.191.i, i64 %.121.i)
  %.16.i466.i = tail call i64 @llvm.smax.i64(i64 %.261.i, i64 %.14.i465.i)
  %.478.i = add nsw i64 %.16.i466.i, -128
  %.479.i = ashr i64 %.478.i, 8
  %.11.i.i = tail call i64 @llvm.smax.i64(i64 %.374.i, i64 0)
  %.11.i467.i = tail call i64 @llvm.smax.i64(i64 %.444.i, i64 0)
  %.11.i468.i = tail call i64 @llvm.smin.i64(i64 %.537.i, i64 %.409.i)
  %.11.i469.i = tail call i64 @llvm.smin.i64(i64 %.569.i, i64 %.479.i)
  %.614.i = icmp sgt i64 %.11.i.i, %.11.i468.i
  %.618.i = icmp sgt i64 %.11.i467.i, %.11.i469.i
  %or.cond459.i = select i1 %.614.i, i1 true, i1 %.618.i
  br i1 %or.cond459.i, label %B599, label %B778.i

B778.i:
  %.657.i = icmp eq i64 %.11.i.i, %.11.i468.i
  %.661.i = icmp eq i64 %.11.i467.i, %.11.i469.i
  %or.cond460.i = select i1 %.657.i, i1 %.661.i, i1 false
  br i1 %or.cond460.i, label %B802.i, label %B908.i

B802.i:
  br i1 %.290.i, label %B836.i, label %B802.B836_crit_edge.i

B802.B836_crit_edge.i:
  %.pre.i = sub nsw i64 %.191.i, %.121.i
  br label %B836.i

B836.i:
  %.11.i.i.pre-phi.i = phi i64 [ %.pre.i, %B802.B836_crit_edge.i ], [ %.273.i, %B802.i ]
  %.10.i.i.pre-phi.i = phi i64 [ %.270.i, %B802.B836_crit_edge.i ], [ %.277.i, %B802.i ]
  %y1.2.0.i = phi i64 [ %.191.i, %B802.B836_crit_edge.i ], [ %.261.i, %B802.i ]
  %x1.2.0.i = phi i64 [ %.159.i, %B802.B836_crit_edge.i ], [ %.229.i, %B802.i ]
  %y2.2.0.i = phi i64 [ %.261.i, %B802.B836_crit_edge.i ], [ %.191.i, %B802.i ]
  %x2.2.0.i = phi i64 [ %.229.i, %B802.B836_crit_edge.i ], [ %.159.i, %B802.i ]
  %.721.i = shl nuw nsw i64 %.11.i.i, 8
  %.722.i = or i64 %.721.i, 128
  %.724.i = shl nuw nsw i64 %.11.i467.i, 8
  %.725.i = or i64 %.724.i, 128
  %.26.i.i.i = icmp sgt i64 %.11.i.i.pre-phi.i, -1
  %.32.i.i.i = icmp ne i64 %y1.2.0.i, %.121.i
  %.37.i.i.i = icmp slt i64 %.10.i.i.pre-phi.i, 1
  %or.cond.not.i.i.i = or i1 %.37.i.i.i, %.32.i.i.i
  %narrow.i.i.i = and i1 %.26.i.i.i, %or.cond.not.i.i.i
  %"$phi98.1.2.0.neg.i.i.i" = sext i1 %narrow.i.i.i to i64
  %.18.i.i.i = sub nsw i64 %.725.i, %.121.i
  %.20.i.i.i = mul nsw i64 %.10.i.i.pre-phi.i, %.18.i.i.i
  %.21.neg.i.i.i = sub nsw i64 %.89.i, %.722.i
  %.23.neg.i.i.i = mul i64 %.11.i.i.pre-phi.i, %.21.neg.i.i.i
  %.24.i.i.i = add i64 %.20.i.i.i, %.23.neg.i.i.i
  %.56.i.i.i = add i64 %.24.i.i.i, %"$phi98.1.2.0.neg.i.i.i"
  %.61.i.i = icmp sgt i64 %.56.i.i.i, -1
  br i1 %.61.i.i, label %B52.i.i, label %B599

B52.i.i:
  %.10.i29.i.i = sub nsw i64 %x2.2.0.i, %x1.2.0.i
  %.11.i30.i.i = sub nsw i64 %y2.2.0.i, %y1.2.0.i
  %.26.i31.i.i = icmp sgt i64 %.11.i30.i.i, -1
  %.32.i32.i.i = icmp ne i32 %.190.i, %.260.i
  %.37.i33.i.i = icmp slt i64 %.10.i29.i.i, 1
  %or.cond.not.i34.i.i = or i1 %.32.i32.i.i, %.37.i33.i.i
  %narrow.i35.i.i = and i1 %.26.i31.i.i, %or.cond.not.i34.i.i
  %"$phi98.1.2.0.neg.i36.i.i" = sext i1 %narrow.i35.i.i to i64
  %.18.i37.i.i = sub nsw i64 %.725.i, %y1.2.0.i
  %.20.i38.i.i = mul nsw i64 %.10.i29.i.i, %.18.i37.i.i
  %.21.neg.i39.i.i = sub nsw i64 %x1.2.0.i, %.722.i
  %.23.neg.i40.i.i = mul i64 %.11.i30.i.i, %.21.neg.i39.i.i
  %.24.i41.i.i = add i64 %.20.i38.i.i, %.23.neg.i40.i.i
  %.56.i42.i.i = add i64 %.24.i41.i.i, %"$phi98.1.2.0.neg.i36.i.i"
  %.101.i.i = icmp sgt i64 %.56.i42.i.i, -1
  br i1 %.101.i.i, label %holds.2.exit.i, label %B599

holds.2.exit.i:
  %.10.i43.i.i = sub nsw i64 %.89.i, %x2.2.0.i
  %.11.i44.i.i = sub nsw i64 %.121.i, %y2.2.0.i
  %.26.i45.i.i = icmp sgt i64 %.11.i44.i.i, -1
  %.32.i46.i.i = icmp ne i64 %y2.2.0.i, %.121.i
  %.37.i47.i.i = icmp slt i64 %.10.i43.i.i, 1
  %or.cond.not.i48.i.i = or i1 %.32.i46.i.i, %.37.i47.i.i
  %narrow.i49.i.i = and i1 %.26.i45.i.i, %or.cond.not.i48.i.i
  %"$phi98.1.2.0.neg.i50.i.i" = sext i1 %narrow.i49.i.i to i64
  %.18.i51.i.i = sub nsw i64 %.725.i, %y2.2.0.i
  %.20.i52.i.i = mul nsw i64 %.10.i43.i.i, %.18.i51.i.i
  %.21.neg.i53.i.i = sub nsw i64 %x2.2.0.i, %.722.i
  %.23.neg.i54.i.i = mul i64 %.21.neg.i53.i.i, %.11.i44.i.i
  %.24.i55.i.i = add i64 %.20.i52.i.i, %.23.neg.i54.i.i
  %.56.i56.i.i = add i64 %.24.i55.i.i, %"$phi98.1.2.0.neg.i50.i.i"
  %.148.i.i = icmp slt i64 %.56.i56.i.i, 0
  br i1 %.148.i.i, label %B599, label %B908.i

B908.i:
  %.841.i = icmp slt i64 %at.3.0687, 0
  %.842.i = select i1 %.841.i, i64 %arg.ready.5.0, i64 0
  %.843.i = add i64 %.842.i, %at.3.0687
  %.863.i = mul i64 %.843.i, %arg.ready.5.1
  %.867.i = getelementptr i32, ptr %arg.ready.4, i64 %.863.i
  store i32 %.386, ptr %.867.i, align 4, !alias.scope !5, !noalias !10
  %arg.c.arg.b.i = select i1 %.290.i, i32 %.498, i32 %.441
  %.937.i = getelementptr i8, ptr %.867.i, i64 4
  store i32 %arg.c.arg.b.i, ptr %.937.i, align 4, !alias.scope !5, !noalias !10
  %"$phi970.0.2.0.i" = select i1 %.290.i, i32 %.441, i32 %.498
  %.1015.i = getelementptr i8, ptr %.867.i, i64 8
  store i32 %"$phi970.0.2.0.i", ptr %.1015.i, align 4, !alias.scope !5, !noalias !10
  %.282.lobit.i = lshr i64 %.282.i, 63
  %"$phi1000.0.2.0.off0.i" = trunc i64 %.282.lobit.i to i32
  %.1085.i = getelementptr i8, ptr %.867.i, i64 12
  store i32 %"$phi1000.0.2.0.off0.i", ptr %.1085.i, align 4, !alias.scope !5, !noalias !10
  %.1163.i = getelementptr i8, ptr %.867.i, i64 16
  %.1164.i = trunc i64 %.11.i.i to i32
  store i32 %.1164.i, ptr %.1163.i, align 4, !alias.scope !5, !noalias !10
  %.1219.i = getelementptr i8, ptr %.867.i, i64 20
  %.1220.i = trunc i64 %.11.i467.i to i32
  store i32 %.1220.i, ptr %.1219.i, align 4, !alias.scope !5, !noalias !10
  %.1275.i = getelementptr i8, ptr %.867.i, i64 24
  %.1276.i = trunc i64 %.11.i468.i to i32
  store i32 %.1276.i, ptr %.1275.i, align 4, !alias.scope !5, !noalias !10
  %.1331.i = getelementptr i8, ptr %.867.i, i64 28
  %.1332.i = trunc i64 %.11.i469.i to i32
  store i32 %.1332.i, ptr %.1331.i, align 4, !alias.scope !5, !noalias !10
  %.1337.i = add nsw i64 %at.3.0687, 1
  br label %B599

B240:
  tail call void @llvm.experimental.noalias.scope.decl(metadata !11)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !14)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !16)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !18)
  %.229.i534 = select i1 %.306, i64 %arg.triangles.5.0, i64 0
  %.230.i = add i64 %.229.i534, %.192.0686
  %.250.i = mul i64 %.230.i, %arg.triangles.5.1
  %8 = getelementptr i32, ptr %arg.triangles.4, i64 %.250.i
  br label %B68.if.i

B134.preheader.i:
  %9 = add nsw i64 %free.2.0688, 10
  br label %B136.if.i

B204.i:
  %.515.i = icmp eq i64 %storemerge.i.i, 0
  %.518.i = icmp ugt i64 %count.2.0823.i, 8
  %or.cond.i535 = select i1 %.515.i, i1 true, i1 %.518.i
  %.523.i = icmp sgt i64 %free.2.0822.i, %9
  %or.cond609.i = select i1 %or.cond.i535, i1 true, i1 %.523.i
  br i1 %or.cond609.i, label %B240.endif, label %B302.if.lr.ph.i

B302.if.lr.ph.i:
  %10 = trunc i64 %count.2.0823.i to i32
  %trunc695 = trunc i63 %.352.0821.i to i62
  br label %B302.if.i

B398.i537:
  %.880.i = icmp slt i64 %kept.3.2815.i, 0
  %.881.i = select i1 %.880.i, i64 %arg.corners.5.1, i64 0
  %11 = getelementptr i64, ptr %1, i64 %kept.3.2815.i
  %.903.i = getelementptr i64, ptr %11, i64 %.881.i
  store i64 %.779.i, ptr %.903.i, align 8, !alias.scope !18, !noalias !20
  %.906.i = add nsw i64 %kept.3.2815.i, 1
  br label %B422.i

B422.i:
  %kept.5.3.i = phi i64 [ %.906.i, %B398.i537 ], [ %kept.3.2815.i, %B304.else.endif.i ]
  %.924.not.i = icmp eq i64 %.839.i, %.842.i536
  br i1 %.924.not.i, label %B626.i, label %B434.i

B434.i:
  %.46.i.i = icmp slt i64 %.779.i, 0
  %.47.i.i = select i1 %.46.i.i, i64 %arg.clip.5.0, i64 0
  %.48.i.i = add i64 %.47.i.i, %.779.i
  %.68.i.i = mul i64 %.48.i.i, %arg.clip.5.1
  %.72.i.i = getelementptr double, ptr %arg.clip.4, i64 %.68.i.i
  %.73.i.i = load double, ptr %.72.i.i, align 8, !alias.scope !22, !noalias !25
  %.125.i.i = getelementptr i8, ptr %.72.i.i, i64 8
  %.126.i.i = load double, ptr %.125.i.i, align 8, !alias.scope !22, !noalias !25
  %.178.i.i = getelementptr i8, ptr %.72.i.i, i64 16
  %.179.i.i = load double, ptr %.178.i.i, align 8, !alias.scope !22, !noalias !25
  %.231.i.i = getelementptr i8, ptr %.72.i.i, i64 24
  %.232.i.i = load double, ptr %.231.i.i, align 8, !alias.scope !22, !noalias !25
  switch i62 %trunc695, label %distance.2.exit.i [
    i62 0, label %distance.2.exit.thread.i
    i62 1, label %distance.2.exit.thread728.i
    i62 2, label %distance.2.exit.thread747.i
    i62 3, label %distance.2.exit.thread766.i
    i62 4, label %distance.2.exit.thread785.i
  ]

distance.2.exit.thread.i:
  %.264.i.i = fadd double %.179.i.i, %.232.i.i
  %.46.i610708.i = icmp slt i64 %.830.i, 0
  %.47.i611709.i = select i1 %.46.i610708.i, i64 %arg.clip.5.0, i64 0
  %.48.i612710.i = add i64 %.47.i611709.i, %.830.i
  %.68.i613711.i = mul i64 %.48.i612710.i, %arg.clip.5.1
  %.72.i614712.i = getelementptr double, ptr %arg.clip.4, i64 %.68.i613711.i
  %.178.i618716.i = getelementptr i8, ptr %.72.i614712.i, i64 16
  %.179.i619717.i = load double, ptr %.178.i618716.i, align 8, !alias.scope !27, !noalias !30
  %.231.i620718.i = getelementptr i8, ptr %.72.i614712.i, i64 24
  %.232.i621719.i = load double, ptr %.231.i620718.i, align 8, !alias.scope !27, !noalias !30
  %.264.i635.i = fadd double %.179.i619717.i, %.232.i621719.i
  br label %distance.2.exit639.i

distance.2.exit.thread728.i:
  %.282.i.i = fsub double %.232.i.i, %.179.i.i
  %.46.i610730.i = icmp slt i64 %.830.i, 0
  %.47.i611731.i = select i1 %.46.i610730.i, i64 %arg.clip.5.0, i64 0
  %.48.i612732.i = add i64 %.47.i611731.i, %.830.i
  %.68.i613733.i = mul i64 %.48.i612732.i, %arg.clip.5.1
  %.72.i614734.i = getelementptr double, ptr %arg.clip.4, i64 %.68.i613733.i
  %.178.i618738.i = getelementptr i8, ptr %.72.i614734.i, i64 16
  %.179.i619739.i = load double, ptr %.178.i618738.i, align 8, !alias.scope !32, !noalias !34
  %.231.i620740.i = getelementptr i8, ptr %.72.i614734.i, i64 24
  %.232.i621741.i = load double, ptr %.231.i620740.i, align 8, !alias.scope !32, !noalias !34
  %.282.i633.i = fsub double %.232.i621741.i, %.179.i619739.i
  br label %distance.2.exit639.i

distance.2.exit.thread747.i:
  %.299.i.i = fmul double %.232.i.i, 8.000000e+00
  %.303.i.i = fsub double %.299.i.i, %.73.i.i
  %.46.i610749.i = icmp slt i64 %.830.i, 0
  %.47.i611750.i = select i1 %.46.i610749.i, i64 %arg.clip.5.0, i64 0
  %.48.i612751.i = add i64 %.47.i611750.i, %.830.i
  %.68.i613752.i = mul i64 %.48.i612751.i, %arg.clip.5.1
  %.72.i614753.i = getelementptr double, ptr %arg.clip.4, i64 %.68.i613752.i
  %.73.i615754.i = load double, ptr %.72.i614753.i, align 8, !alias.scope !36, !noalias !38
  %.231.i620759.i = getelementptr i8, ptr %.72.i614753.i, i64 24
  %.232.i621760.i = load double, ptr %.231.i620759.i, align 8, !alias.scope !36, !noalias !38
  %.299.i630.i = fmul double %.232.i621760.i, 8.000000e+00
  %.303.i631.i = fsub double %.299.i630.i, %.73.i615754.i
  br label %distance.2.exit639.i

distance.2.exit.thread766.i:
  %.316.i.i = fmul double %.232.i.i, 8.000000e+00
  %.320.i.i = fadd double %.73.i.i, %.316.i.i
  %.46.i610768.i = icmp slt i64 %.830.i, 0
  %.47.i611769.i = select i1 %.46.i610768.i, i64 %arg.clip.5.0, i64 0
  %.48.i612770.i = add i64 %.47.i611769.i, %.830.i
  %.68.i613771.i = mul i64 %.48.i612770.i, %arg.clip.5.1
  %.72.i614772.i = getelementptr double, ptr %arg.clip.4, i64 %.68.i613771.i
  %.73.i615773.i = load double, ptr %.72.i614772.i, align 8, !alias.scope !40, !noalias !42
  %.231.i620778.i = getelementptr i8, ptr %.72.i614772.i, i64 24
  %.232.i621779.i = load double, ptr %.231.i620778.i, align 8, !alias.scope !40, !noalias !42
  %.316.i627.i = fmul double %.232.i621779.i, 8.000000e+00
  %.320.i628.i = fadd double %.73.i615773.i, %.316.i627.i
  br label %distance.2.exit639.i

distance.2.exit.thread785.i:
  %.333.i.i = fmul double %.232.i.i, 8.000000e+00
  %.337.i.i = fsub double %.333.i.i, %.126.i.i
  %.46.i610787.i = icmp slt i64 %.830.i, 0
  %.47.i611788.i = select i1 %.46.i610787.i, i64 %arg.clip.5.0, i64 0
  %.48.i612789.i = add i64 %.47.i611788.i, %.830.i
  %.68.i613790.i = mul i64 %.48.i612789.i, %arg.clip.5.1
  %.72.i614791.i = getelementptr double, ptr %arg.clip.4, i64 %.68.i613790.i
  %.125.i616793.i = getelementptr i8, ptr %.72.i614791.i, i64 8
  %.126.i617794.i = load double, ptr %.125.i616793.i, align 8, !alias.scope !44, !noalias !46
  %.231.i620797.i = getelementptr i8, ptr %.72.i614791.i, i64 24
  %.232.i621798.i = load double, ptr %.231.i620797.i, align 8, !alias.scope !44, !noalias !46
  %.333.i623.i = fmul double %.232.i621798.i, 8.000000e+00
  %.337.i624.i = fsub double %.333.i623.i, %.126.i617794.i
  br label %distance.2.exit639.i

distance.2.exit.i:
  %.343.i.i = fmul double %.232.i.i, 8.000000e+00
  %.347.i.i = fadd double %.126.i.i, %.343.i.i
  %.46.i610.i = icmp slt i64 %.830.i, 0
  %.47.i611.i = select i1 %.46.i610.i, i64 %arg.clip.5.0, i64 0
  %.48.i612.i = add i64 %.47.i611.i, %.830.i
  %.68.i613.i = mul i64 %.48.i612.i, %arg.clip.5.1
  %.72.i614.i = getelementptr double, ptr %arg.clip.4, i64 %.68.i613.i
  %.125.i616.i = getelementptr i8, ptr %.72.i614.i, i64 8
  %.126.i617.i = load double, ptr %.125.i616.i, align 8, !alias.scope !48, !noalias !50
  %.231.i620.i = getelementptr i8, ptr %.72.i614.i, i64 24
  %.232.i621.i = load double, ptr %.231.i620.i, align 8, !alias.scope !48, !noalias !50
  %.343.i637.i = fmul double %.232.i621.i, 8.000000e+00
  %.347.i638.i = fadd double %.126.i617.i, %.343.i637.i
  br label %distance.2.exit639.i

distance.2.exit639.i:
  %.72.i614724.i = phi ptr [ %.72.i614.i, %distance.2.exit.i ], [ %.72.i614791.i, %distance.2.exit.thread785.i ], [ %.72.i614772.i, %distance.2.exit.thread766.i ], [ %.72.i614753.i, %distance.2.exit.thread747.i ], [ %.72.i614734.i, %distance.2.exit.thread728.i ], [ %.72.i614712.i, %distance.2.exit.thread.i ]
  %.46.i610722.i = phi i1 [ %.46.i610.i, %distance.2.exit.i ], [ %.46.i610787.i, %distance.2.exit.thread785.i ], [ %.46.i610768.i, %distance.2.exit.thread766.i ], [ %.46.i610749.i, %distance.2.exit.thread747.i ], [ %.46.i610730.i, %distance.2.exit.thread728.i ], [ %.46.i610708.i, %distance.2.exit.thread.i ]
  %.347.sink.i720.i = phi double [ %.347.i.i, %distance.2.exit.i ], [ %.337.i.i, %distance.2.exit.thread785.i ], [ %.320.i.i, %distance.2.exit.thread766.i ], [ %.303.i.i, %distance.2.exit.thread747.i ], [ %.282.i.i, %distance.2.exit.thread728.i ], [ %.264.i.i, %distance.2.exit.thread.i ]
  %.347.sink.i625.i = phi double [ %.347.i638.i, %distance.2.exit.i ], [ %.337.i624.i, %distance.2.exit.thread785.i ], [ %.320.i628.i, %distance.2.exit.thread766.i ], [ %.303.i631.i, %distance.2.exit.thread747.i ], [ %.282.i633.i, %distance.2.exit.thread728.i ], [ %.264.i635.i, %distance.2.exit.thread.i ]
  %.310.i655.i = icmp slt i64 %free.4.2814.i, 0
  %.311.i656.i = select i1 %.310.i655.i, i64 %arg.clip.5.0, i64 0
  %.312.i657.i = add i64 %.311.i656.i, %free.4.2814.i
  %.332.i658.i = mul i64 %.312.i657.i, %arg.clip.5.1
  %12 = getelementptr double, ptr %arg.clip.4, i64 %.332.i658.i
  br i1 %.850.not.i, label %B550.i, label %B506.i

B506.i:
  tail call void @llvm.experimental.noalias.scope.decl(metadata !52)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !55)
  %.45.i.i = fsub double %.347.sink.i720.i, %.347.sink.i625.i
  %.46.i640.i = fneg double %.347.sink.i625.i
  %.50.i.i = fdiv double %.46.i640.i, %.45.i.i
  %.54.i.i = fdiv double %.347.sink.i720.i, %.45.i.i
  br label %B66.if.i.i

B136.i.i:
  %.346.i.i = fptrunc double %.50.i.i to float
  %.350.i.i = fptrunc double %.54.i.i to float
  br i1 %.451223.not.i.i, label %B592.i, label %B268.if.lr.ph.i.i

B268.if.lr.ph.i.i:
  %.513.i.i = select i1 %.46.i.i, i64 %arg.varyings.5.0, i64 0
  %.514.i.i = add i64 %.513.i.i, %.779.i
  %.534.i.i = mul i64 %.514.i.i, %arg.varyings.5.1
  %13 = getelementptr float, ptr %arg.varyings.4, i64 %.534.i.i
  %.566.i.i = select i1 %.46.i610722.i, i64 %arg.varyings.5.0, i64 0
  %.567.i.i = add i64 %.566.i.i, %.830.i
  %.587.i.i = mul i64 %.567.i.i, %arg.varyings.5.1
  %14 = getelementptr float, ptr %arg.varyings.4, i64 %.587.i.i
  %.620.i.i = select i1 %.310.i655.i, i64 %arg.varyings.5.0, i64 0
  %.621.i.i = add i64 %.620.i.i, %free.4.2814.i
  %.641.i.i = mul i64 %.621.i.i, %arg.varyings.5.1
  %15 = getelementptr float, ptr %arg.varyings.4, i64 %.641.i.i
  br label %B268.if.i.i

B66.if.i.i:
  %.87.0222.i.i = phi i64 [ 4, %B506.i ], [ %.151.i.i, %B66.if.i.i ]
  %.84.0221.i.i = phi i64 [ 0, %B506.i ], [ %.155.i.i, %B66.if.i.i ]
  %.151.i.i = add nsw i64 %.87.0222.i.i, -1
  %.155.i.i = add nuw nsw i64 %.84.0221.i.i, 1
  %.229.i.i = getelementptr double, ptr %.72.i.i, i64 %.84.0221.i.i
  %.230.i.i = load double, ptr %.229.i.i, align 8, !alias.scope !57, !noalias !58
  %.232.i641.i = fmul double %.50.i.i, %.230.i.i
  %.282.i642.i = getelementptr double, ptr %.72.i614724.i, i64 %.84.0221.i.i
  %.283.i.i = load double, ptr %.282.i642.i, align 8, !alias.scope !57, !noalias !58
  %.285.i.i = fmul double %.54.i.i, %.283.i.i
  %.286.i.i = fadd double %.232.i641.i, %.285.i.i
  %.336.i.i = getelementptr double, ptr %12, i64 %.84.0221.i.i
  store double %.286.i.i, ptr %.336.i.i, align 8, !alias.scope !57, !noalias !58
  %.142.i.i = icmp ugt i64 %.87.0222.i.i, 1
  br i1 %.142.i.i, label %B66.if.i.i, label %B136.i.i

B268.if.i.i:
  %.398.0225.i.i = phi i64 [ %arg.varyings.5.1, %B268.if.lr.ph.i.i ], [ %.460.i.i, %B268.if.i.i ]
  %.395.0224.i.i = phi i64 [ 0, %B268.if.lr.ph.i.i ], [ %.464.i.i, %B268.if.i.i ]
  %.460.i.i = add nsw i64 %.398.0225.i.i, -1
  %.464.i.i = add nuw nsw i64 %.395.0224.i.i, 1
  %.538.i.i = getelementptr float, ptr %13, i64 %.395.0224.i.i
  %.539.i.i = load float, ptr %.538.i.i, align 4, !alias.scope !60, !noalias !61
  %.541.i.i = fmul float %.539.i.i, %.346.i.i
  %.591.i.i = getelementptr float, ptr %14, i64 %.395.0224.i.i
  %.592.i.i = load float, ptr %.591.i.i, align 4, !alias.scope !60, !noalias !61
  %.594.i.i = fmul float %.592.i.i, %.350.i.i
  %.595.i.i = fadd float %.541.i.i, %.594.i.i
  %.645.i.i = getelementptr float, ptr %15, i64 %.395.0224.i.i
  store float %.595.i.i, ptr %.645.i.i, align 4, !alias.scope !60, !noalias !61
  %.451.i.i = icmp ugt i64 %.398.0225.i.i, 1
  br i1 %.451.i.i, label %B268.if.i.i, label %B592.i

B550.i:
  tail call void @llvm.experimental.noalias.scope.decl(metadata !62)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !65)
  %.45.i643.i = fsub double %.347.sink.i625.i, %.347.sink.i720.i
  %.46.i644.i = fneg double %.347.sink.i720.i
  %.50.i645.i = fdiv double %.46.i644.i, %.45.i643.i
  %.54.i646.i = fdiv double %.347.sink.i625.i, %.45.i643.i
  br label %B66.if.i659.i

B136.i673.i:
  %.346.i674.i = fptrunc double %.50.i645.i to float
  %.350.i675.i = fptrunc double %.54.i646.i to float
  br i1 %.451223.not.i.i, label %B592.i, label %B268.if.lr.ph.i677.i

B268.if.lr.ph.i677.i:
  %.513.i678.i = select i1 %.46.i610722.i, i64 %arg.varyings.5.0, i64 0
  %.514.i679.i = add i64 %.513.i678.i, %.830.i
  %.534.i680.i = mul i64 %.514.i679.i, %arg.varyings.5.1
  %16 = getelementptr float, ptr %arg.varyings.4, i64 %.534.i680.i
  %.566.i681.i = select i1 %.46.i.i, i64 %arg.varyings.5.0, i64 0
  %.567.i682.i = add i64 %.566.i681.i, %.779.i
  %.587.i683.i = mul i64 %.567.i682.i, %arg.varyings.5.1
  %17 = getelementptr float, ptr %arg.varyings.4, i64 %.587.i683.i
  %.620.i684.i = select i1 %.310.i655.i, i64 %arg.varyings.5.0, i64 0
  %.621.i685.i = add i64 %.620.i684.i, %free.4.2814.i
  %.641.i686.i = mul i64 %.621.i685.i, %arg.varyings.5.1
  %18 = getelementptr float, ptr %arg.varyings.4, i64 %.641.i686.i
  br label %B268.if.i687.i

B66.if.i659.i:
  %.87.0222.i660.i = phi i64 [ 4, %B550.i ], [ %.151.i662.i, %B66.if.i659.i ]
  %.84.0221.i661.i = phi i64 [ 0, %B550.i ], [ %.155.i663.i, %B66.if.i659.i ]
  %.151.i662.i = add nsw i64 %.87.0222.i660.i, -1
  %.155.i663.i = add nuw nsw i64 %.84.0221.i661.i, 1
  %.229.i664.i = getelementptr double, ptr %.72.i614724.i, i64 %.84.0221.i661.i
  %.230.i665.i = load double, ptr %.229.i664.i, align 8, !alias.scope !67, !noalias !68
  %.232.i666.i = fmul double %.50.i645.i, %.230.i665.i
  %.282.i667.i = getelementptr double, ptr %.72.i.i, i64 %.84.0221.i661.i
  %.283.i668.i = load double, ptr %.282.i667.i, align 8, !alias.scope !67, !noalias !68
  %.285.i669.i = fmul double %.54.i646.i, %.283.i668.i
  %.286.i670.i = fadd double %.232.i666.i, %.285.i669.i
  %.336.i671.i = getelementptr double, ptr %12, i64 %.84.0221.i661.i
  store double %.286.i670.i, ptr %.336.i671.i, align 8, !alias.scope !67, !noalias !68
  %.142.i672.i = icmp ugt i64 %.87.0222.i660.i, 1
  br i1 %.142.i672.i, label %B66.if.i659.i, label %B136.i673.i

B268.if.i687.i:
  %.398.0225.i688.i = phi i64 [ %arg.varyings.5.1, %B268.if.lr.ph.i677.i ], [ %.460.i690.i, %B268.if.i687.i ]
  %.395.0224.i689.i = phi i64 [ 0, %B268.if.lr.ph.i677.i ], [ %.464.i691.i, %B268.if.i687.i ]
  %.460.i690.i = add nsw i64 %.398.0225.i688.i, -1
  %.464.i691.i = add nuw nsw i64 %.395.0224.i689.i, 1
  %.538.i692.i = getelementptr float, ptr %16, i64 %.395.0224.i689.i
  %.539.i693.i = load float, ptr %.538.i692.i, align 4, !alias.scope !70, !noalias !71
  %.541.i694.i = fmul float %.539.i693.i, %.346.i674.i
  %.591.i695.i = getelementptr float, ptr %17, i64 %.395.0224.i689.i
  %.592.i696.i = load float, ptr %.591.i695.i, align 4, !alias.scope !70, !noalias !71
  %.594.i697.i = fmul float %.592.i696.i, %.350.i675.i
  %.595.i698.i = fadd float %.541.i694.i, %.594.i697.i
  %.645.i699.i = getelementptr float, ptr %18, i64 %.395.0224.i689.i
  store float %.595.i698.i, ptr %.645.i699.i, align 4, !alias.scope !70, !noalias !71
  %.451.i700.i = icmp ugt i64 %.398.0225.i688.i, 1
  br i1 %.451.i700.i, label %B268.if.i687.i, label %B592.i

B592.i:
  %.1133.i = icmp slt i64 %kept.5.3.i, 0
  %.1134.i = select i1 %.1133.i, i64 %arg.corners.5.1, i64 0
  %19 = getelementptr i64, ptr %1, i64 %kept.5.3.i
  %.1156.i = getelementptr i64, ptr %19, i64 %.1134.i
  store i64 %free.4.2814.i, ptr %.1156.i, align 8, !alias.scope !18, !noalias !20
  %.1159.i = add nsw i64 %kept.5.3.i, 1
  %.1165.i = add nsw i64 %free.4.2814.i, 1
  br label %B626.i

B626.i:
  %free.5.3.i = phi i64 [ %.1165.i, %B592.i ], [ %free.4.2814.i, %B422.i ]
  %kept.4.3.i = phi i64 [ %.1159.i, %B592.i ], [ %kept.5.3.i, %B422.i ]
  %.645.i = icmp ugt i64 %.592.0813.i, 1
  br i1 %.645.i, label %B302.if.i, label %B628.i

B628.i:
  %.1286817.not.i = icmp slt i64 %kept.4.3.i, 1
  br i1 %.1286817.not.i, label %B240.endif, label %B662.if.i

B698.i:
  %.1432.i = icmp ult i64 %kept.4.3.i, 3
  br i1 %.1432.i, label %B240.endif, label %B727.i

B727.i:
  %free.3.1.i = phi i64 [ %free.2.0822.i, %B138.endif.i ], [ %free.5.3.i, %B698.i ]
  %count.3.1.i = phi i64 [ %count.2.0823.i, %B138.endif.i ], [ %kept.4.3.i, %B698.i ]
  %.409.i538 = icmp ugt i64 %.355.0820.i, 1
  br i1 %.409.i538, label %B136.if.i, label %B240.endif

B68.if.i:
  %.109.0810.i = phi i64 [ 0, %B240 ], [ %.180.i, %B68.if.i ]
  %.112.0809.i = phi i64 [ 3, %B240 ], [ %.176.i, %B68.if.i ]
  %.176.i = add nsw i64 %.112.0809.i, -1
  %.180.i = add nuw nsw i64 %.109.0810.i, 1
  %20 = getelementptr i32, ptr %8, i64 %.109.0810.i
  %.255.i = load i32, ptr %20, align 4, !alias.scope !11, !noalias !72
  %21 = getelementptr i64, ptr %0, i64 %.109.0810.i
  %.306.i = sext i32 %.255.i to i64
  store i64 %.306.i, ptr %21, align 8, !alias.scope !18, !noalias !20
  %.167.i = icmp ugt i64 %.112.0809.i, 1
  br i1 %.167.i, label %B68.if.i, label %B134.preheader.i

B136.if.i:
  %count.2.0823.i = phi i64 [ 3, %B134.preheader.i ], [ %count.3.1.i, %B727.i ]
  %free.2.0822.i = phi i64 [ %free.2.0688, %B134.preheader.i ], [ %free.3.1.i, %B727.i ]
  %.352.0821.i = phi i63 [ 0, %B134.preheader.i ], [ %.422.i, %B727.i ]
  %.355.0820.i = phi i64 [ 6, %B134.preheader.i ], [ %.418.i, %B727.i ]
  %.418.i = add nsw i64 %.355.0820.i, -1
  %.422.i = add nuw nsw i63 %.352.0821.i, 1
  tail call void @llvm.experimental.noalias.scope.decl(metadata !73)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !76)
  %.98.i.i = load i64, ptr %0, align 8, !alias.scope !78, !noalias !79
  %.46.i.i.i = icmp slt i64 %.98.i.i, 0
  %.47.i.i.i = select i1 %.46.i.i.i, i64 %arg.clip.5.0, i64 0
  %.48.i.i.i = add i64 %.47.i.i.i, %.98.i.i
  %.68.i.i.i = mul i64 %.48.i.i.i, %arg.clip.5.1
  %.72.i.i.i = getelementptr double, ptr %arg.clip.4, i64 %.68.i.i.i
  %.73.i.i.i = load double, ptr %.72.i.i.i, align 8, !alias.scope !81, !noalias !84
  %.125.i.i.i = getelementptr i8, ptr %.72.i.i.i, i64 8
  %.126.i.i.i = load double, ptr %.125.i.i.i, align 8, !alias.scope !81, !noalias !84
  %.178.i.i.i = getelementptr i8, ptr %.72.i.i.i, i64 16
  %.179.i.i.i = load double, ptr %.178.i.i.i, align 8, !alias.scope !81, !noalias !84
  %.231.i.i.i = getelementptr i8, ptr %.72.i.i.i, i64 24
  %.232.i.i.i = load double, ptr %.231.i.i.i, align 8, !alias.scope !81, !noalias !84
  %trunc = trunc i63 %.352.0821.i to i62
  switch i62 %trunc, label %B218.i.i.i [
    i62 0, label %B102.i.i.i
    i62 1, label %B124.i.i.i
    i62 2, label %B146.i.i.i
    i62 3, label %B174.i.i.i
    i62 4, label %B202.i.i.i
  ]

B102.i.i.i:
  %.264.i.i.i = fadd double %.179.i.i.i, %.232.i.i.i
  br label %distance.2.exit.i.i

B124.i.i.i:
  %.282.i.i.i = fsub double %.232.i.i.i, %.179.i.i.i
  br label %distance.2.exit.i.i

B146.i.i.i:
  %.299.i.i.i = fmul double %.232.i.i.i, 8.000000e+00
  %.303.i.i.i = fsub double %.299.i.i.i, %.73.i.i.i
  br label %distance.2.exit.i.i

B174.i.i.i:
  %.316.i.i.i = fmul double %.232.i.i.i, 8.000000e+00
  %.320.i.i.i = fadd double %.73.i.i.i, %.316.i.i.i
  br label %distance.2.exit.i.i

B202.i.i.i:
  %.333.i.i.i = fmul double %.232.i.i.i, 8.000000e+00
  %.337.i.i.i = fsub double %.333.i.i.i, %.126.i.i.i
  br label %distance.2.exit.i.i

B218.i.i.i:
  %.343.i.i.i = fmul double %.232.i.i.i, 8.000000e+00
  %.347.i.i.i = fadd double %.126.i.i.i, %.343.i.i.i
  br label %distance.2.exit.i.i

distance.2.exit.i.i:
  %.347.sink.i.i.i = phi double [ %.347.i.i.i, %B218.i.i.i ], [ %.337.i.i.i, %B202.i.i.i ], [ %.320.i.i.i, %B174.i.i.i ], [ %.303.i.i.i, %B146.i.i.i ], [ %.282.i.i.i, %B124.i.i.i ], [ %.264.i.i.i, %B102.i.i.i ]
  %.174.i.i = add nsw i64 %count.2.0823.i, -1
  %22 = icmp ult i64 %count.2.0823.i, 4294967297
  %23 = and i64 %.174.i.i, 4294967295
  %spec.select.i.i = select i1 %22, i64 %23, i64 %.174.i.i
  %.217375.not.i.i = icmp eq i64 %spec.select.i.i, 0
  br i1 %.217375.not.i.i, label %B166.i.i, label %B90.if.i.i.preheader

B90.if.i.i.preheader:
  %trunc692 = trunc i63 %.352.0821.i to i62
  br label %B90.if.i.i

B166.i.i:
  %most.2.0.lcssa.i.i = phi double [ %.347.sink.i.i.i, %distance.2.exit.i.i ], [ %most.3.1.i.i, %distance.2.exit372.i.i ]
  %deepest.2.0.lcssa.i.i = phi i64 [ 0, %distance.2.exit.i.i ], [ %deepest.3.1.i.i, %distance.2.exit372.i.i ]
  %.391.i.i = fcmp ult double %most.2.0.lcssa.i.i, 0.000000e+00
  br i1 %.391.i.i, label %B138.endif.i, label %B182.i.i

B182.i.i:
  %.410.i.i = shl nuw i64 1, %deepest.2.0.lcssa.i.i
  %24 = trunc i64 %count.2.0823.i to i32
  %trunc693 = trunc i63 %.352.0821.i to i62
  %trunc694 = trunc i63 %.352.0821.i to i62
  br label %B206.if.i.i

B238.i.i:
  %.593.i.i = icmp slt i64 %.513.0.i.i, 0
  %.594.i706.i = select i1 %.593.i.i, i64 %arg.corners.5.1, i64 0
  %25 = getelementptr i64, ptr %0, i64 %.513.0.i.i
  %.616.i.i = getelementptr i64, ptr %25, i64 %.594.i706.i
  %.617.i.i = load i64, ptr %.616.i.i, align 8, !alias.scope !78, !noalias !79
  %.46.i283.i.i = icmp slt i64 %.617.i.i, 0
  %.47.i284.i.i = select i1 %.46.i283.i.i, i64 %arg.clip.5.0, i64 0
  %.48.i285.i.i = add i64 %.47.i284.i.i, %.617.i.i
  %.68.i286.i.i = mul i64 %.48.i285.i.i, %arg.clip.5.1
  %.72.i287.i.i = getelementptr double, ptr %arg.clip.4, i64 %.68.i286.i.i
  %.73.i288.i.i = load double, ptr %.72.i287.i.i, align 8, !alias.scope !86, !noalias !89
  %.125.i289.i.i = getelementptr i8, ptr %.72.i287.i.i, i64 8
  %.126.i290.i.i = load double, ptr %.125.i289.i.i, align 8, !alias.scope !86, !noalias !89
  %.178.i291.i.i = getelementptr i8, ptr %.72.i287.i.i, i64 16
  %.179.i292.i.i = load double, ptr %.178.i291.i.i, align 8, !alias.scope !86, !noalias !89
  %.231.i293.i.i = getelementptr i8, ptr %.72.i287.i.i, i64 24
  %.232.i294.i.i = load double, ptr %.231.i293.i.i, align 8, !alias.scope !86, !noalias !89
  switch i62 %trunc693, label %B218.i309.i.i [
    i62 0, label %B102.i307.i.i
    i62 1, label %B124.i305.i.i
    i62 2, label %B146.i302.i.i
    i62 3, label %B174.i299.i.i
    i62 4, label %B202.i295.i.i
  ]

B102.i307.i.i:
  %.264.i308.i.i = fadd double %.179.i292.i.i, %.232.i294.i.i
  br label %distance.2.exit312.i.i

B124.i305.i.i:
  %.282.i306.i.i = fsub double %.232.i294.i.i, %.179.i292.i.i
  br label %distance.2.exit312.i.i

B146.i302.i.i:
  %.299.i303.i.i = fmul double %.232.i294.i.i, 8.000000e+00
  %.303.i304.i.i = fsub double %.299.i303.i.i, %.73.i288.i.i
  br label %distance.2.exit312.i.i

B174.i299.i.i:
  %.316.i300.i.i = fmul double %.232.i294.i.i, 8.000000e+00
  %.320.i301.i.i = fadd double %.73.i288.i.i, %.316.i300.i.i
  br label %distance.2.exit312.i.i

B202.i295.i.i:
  %.333.i296.i.i = fmul double %.232.i294.i.i, 8.000000e+00
  %.337.i297.i.i = fsub double %.333.i296.i.i, %.126.i290.i.i
  br label %distance.2.exit312.i.i

B218.i309.i.i:
  %.343.i310.i.i = fmul double %.232.i294.i.i, 8.000000e+00
  %.347.i311.i.i = fadd double %.126.i290.i.i, %.343.i310.i.i
  br label %distance.2.exit312.i.i

distance.2.exit312.i.i:
  %.347.sink.i298.i.i = phi double [ %.347.i311.i.i, %B218.i309.i.i ], [ %.337.i297.i.i, %B202.i295.i.i ], [ %.320.i301.i.i, %B174.i299.i.i ], [ %.303.i304.i.i, %B146.i302.i.i ], [ %.282.i306.i.i, %B124.i305.i.i ], [ %.264.i308.i.i, %B102.i307.i.i ]
  %.648.i.i = fcmp ult double %.347.sink.i298.i.i, 0.000000e+00
  br i1 %.648.i.i, label %B398.i.i, label %B296.i.i

B296.i.i:
  %k.3.1.i.i = phi i64 [ %.681.0.i.i, %distance.2.exit342.i.i ], [ %.513.0.i.i, %distance.2.exit312.i.i ]
  %run.2.1.i.i = phi i64 [ %.656.i.i, %distance.2.exit342.i.i ], [ %run.3.0382.i.i, %distance.2.exit312.i.i ]
  %.654.i.i = shl nuw i64 1, %k.3.1.i.i
  %.656.i.i = or i64 %run.2.1.i.i, %.654.i.i
  %.667.i.i = add nsw i64 %k.3.1.i.i, %.425.0381.off0.i.i
  %26 = or i64 %.667.i.i, %count.2.0823.i
  %27 = icmp ult i64 %26, 4294967296
  br i1 %27, label %39, label %43

B340.i.i:
  %.759.i.i = icmp slt i64 %.681.0.i.i, 0
  %.760.i.i = select i1 %.759.i.i, i64 %arg.corners.5.1, i64 0
  %28 = getelementptr i64, ptr %0, i64 %.681.0.i.i
  %.782.i.i = getelementptr i64, ptr %28, i64 %.760.i.i
  %.783.i.i = load i64, ptr %.782.i.i, align 8, !alias.scope !78, !noalias !79
  %.46.i313.i.i = icmp slt i64 %.783.i.i, 0
  %.47.i314.i.i = select i1 %.46.i313.i.i, i64 %arg.clip.5.0, i64 0
  %.48.i315.i.i = add i64 %.47.i314.i.i, %.783.i.i
  %.68.i316.i.i = mul i64 %.48.i315.i.i, %arg.clip.5.1
  %.72.i317.i.i = getelementptr double, ptr %arg.clip.4, i64 %.68.i316.i.i
  %.73.i318.i.i = load double, ptr %.72.i317.i.i, align 8, !alias.scope !91, !noalias !94
  %.125.i319.i.i = getelementptr i8, ptr %.72.i317.i.i, i64 8
  %.126.i320.i.i = load double, ptr %.125.i319.i.i, align 8, !alias.scope !91, !noalias !94
  %.178.i321.i.i = getelementptr i8, ptr %.72.i317.i.i, i64 16
  %.179.i322.i.i = load double, ptr %.178.i321.i.i, align 8, !alias.scope !91, !noalias !94
  %.231.i323.i.i = getelementptr i8, ptr %.72.i317.i.i, i64 24
  %.232.i324.i.i = load double, ptr %.231.i323.i.i, align 8, !alias.scope !91, !noalias !94
  switch i62 %trunc694, label %B218.i339.i.i [
    i62 0, label %B102.i337.i.i
    i62 1, label %B124.i335.i.i
    i62 2, label %B146.i332.i.i
    i62 3, label %B174.i329.i.i
    i62 4, label %B202.i325.i.i
  ]

B102.i337.i.i:
  %.264.i338.i.i = fadd double %.179.i322.i.i, %.232.i324.i.i
  br label %distance.2.exit342.i.i

B124.i335.i.i:
  %.282.i336.i.i = fsub double %.232.i324.i.i, %.179.i322.i.i
  br label %distance.2.exit342.i.i

B146.i332.i.i:
  %.299.i333.i.i = fmul double %.232.i324.i.i, 8.000000e+00
  %.303.i334.i.i = fsub double %.299.i333.i.i, %.73.i318.i.i
  br label %distance.2.exit342.i.i

B174.i329.i.i:
  %.316.i330.i.i = fmul double %.232.i324.i.i, 8.000000e+00
  %.320.i331.i.i = fadd double %.73.i318.i.i, %.316.i330.i.i
  br label %distance.2.exit342.i.i

B202.i325.i.i:
  %.333.i326.i.i = fmul double %.232.i324.i.i, 8.000000e+00
  %.337.i327.i.i = fsub double %.333.i326.i.i, %.126.i320.i.i
  br label %distance.2.exit342.i.i

B218.i339.i.i:
  %.343.i340.i.i = fmul double %.232.i324.i.i, 8.000000e+00
  %.347.i341.i.i = fadd double %.126.i320.i.i, %.343.i340.i.i
  br label %distance.2.exit342.i.i

distance.2.exit342.i.i:
  %.347.sink.i328.i.i = phi double [ %.347.i341.i.i, %B218.i339.i.i ], [ %.337.i327.i.i, %B202.i325.i.i ], [ %.320.i331.i.i, %B174.i329.i.i ], [ %.303.i334.i.i, %B146.i332.i.i ], [ %.282.i336.i.i, %B124.i335.i.i ], [ %.264.i338.i.i, %B102.i337.i.i ]
  %.814.i.i = fcmp ult double %.347.sink.i328.i.i, 0.000000e+00
  br i1 %.814.i.i, label %B398.i.i, label %B296.i.i

B398.i.i:
  %run.4.2.i.i = phi i64 [ %run.3.0382.i.i, %distance.2.exit312.i.i ], [ %run.3.0382.i.i, %B208.else.endif.i.i ], [ %.656.i.i, %distance.2.exit342.i.i ], [ %.656.i.i, %B296.else.endif.i.i ]
  br i1 %.450.i.i, label %B206.if.i.i, label %B138.endif.i

B90.if.i.i:
  %deepest.2.0379.i.i = phi i64 [ %deepest.3.1.i.i, %distance.2.exit372.i.i ], [ 0, %B90.if.i.i.preheader ]
  %most.2.0378.i.i = phi double [ %most.3.1.i.i, %distance.2.exit372.i.i ], [ %.347.sink.i.i.i, %B90.if.i.i.preheader ]
  %.161.0377.i.i = phi i64 [ %.230.i704.i, %distance.2.exit372.i.i ], [ 1, %B90.if.i.i.preheader ]
  %.164.0376.i.i = phi i64 [ %.226.i.i, %distance.2.exit372.i.i ], [ %spec.select.i.i, %B90.if.i.i.preheader ]
  %.226.i.i = add nsw i64 %.164.0376.i.i, -1
  %.230.i704.i = add nuw i64 %.161.0377.i.i, 1
  %29 = getelementptr i64, ptr %0, i64 %.161.0377.i.i
  %.320.i705.i = load i64, ptr %29, align 8, !alias.scope !78, !noalias !79
  %.46.i343.i.i = icmp slt i64 %.320.i705.i, 0
  %.47.i344.i.i = select i1 %.46.i343.i.i, i64 %arg.clip.5.0, i64 0
  %.48.i345.i.i = add i64 %.47.i344.i.i, %.320.i705.i
  %.68.i346.i.i = mul i64 %.48.i345.i.i, %arg.clip.5.1
  %.72.i347.i.i = getelementptr double, ptr %arg.clip.4, i64 %.68.i346.i.i
  %.73.i348.i.i = load double, ptr %.72.i347.i.i, align 8, !alias.scope !96, !noalias !99
  %.125.i349.i.i = getelementptr i8, ptr %.72.i347.i.i, i64 8
  %.126.i350.i.i = load double, ptr %.125.i349.i.i, align 8, !alias.scope !96, !noalias !99
  %.178.i351.i.i = getelementptr i8, ptr %.72.i347.i.i, i64 16
  %.179.i352.i.i = load double, ptr %.178.i351.i.i, align 8, !alias.scope !96, !noalias !99
  %.231.i353.i.i = getelementptr i8, ptr %.72.i347.i.i, i64 24
  %.232.i354.i.i = load double, ptr %.231.i353.i.i, align 8, !alias.scope !96, !noalias !99
  switch i62 %trunc692, label %B218.i369.i.i [
    i62 0, label %B102.i367.i.i
    i62 1, label %B124.i365.i.i
    i62 2, label %B146.i362.i.i
    i62 3, label %B174.i359.i.i
    i62 4, label %B202.i355.i.i
  ]

B102.i367.i.i:
  %.264.i368.i.i = fadd double %.179.i352.i.i, %.232.i354.i.i
  br label %distance.2.exit372.i.i

B124.i365.i.i:
  %.282.i366.i.i = fsub double %.232.i354.i.i, %.179.i352.i.i
  br label %distance.2.exit372.i.i

B146.i362.i.i:
  %.299.i363.i.i = fmul double %.232.i354.i.i, 8.000000e+00
  %.303.i364.i.i = fsub double %.299.i363.i.i, %.73.i348.i.i
  br label %distance.2.exit372.i.i

B174.i359.i.i:
  %.316.i360.i.i = fmul double %.232.i354.i.i, 8.000000e+00
  %.320.i361.i.i = fadd double %.73.i348.i.i, %.316.i360.i.i
  br label %distance.2.exit372.i.i

B202.i355.i.i:
  %.333.i356.i.i = fmul double %.232.i354.i.i, 8.000000e+00
  %.337.i357.i.i = fsub double %.333.i356.i.i, %.126.i350.i.i
  br label %distance.2.exit372.i.i

B218.i369.i.i:
  %.343.i370.i.i = fmul double %.232.i354.i.i, 8.000000e+00
  %.347.i371.i.i = fadd double %.126.i350.i.i, %.343.i370.i.i
  br label %distance.2.exit372.i.i

distance.2.exit372.i.i:
  %.347.sink.i358.i.i = phi double [ %.347.i371.i.i, %B218.i369.i.i ], [ %.337.i357.i.i, %B202.i355.i.i ], [ %.320.i361.i.i, %B174.i359.i.i ], [ %.303.i364.i.i, %B146.i362.i.i ], [ %.282.i366.i.i, %B124.i365.i.i ], [ %.264.i368.i.i, %B102.i367.i.i ]
  %.356.i.i = fcmp ogt double %.347.sink.i358.i.i, %most.2.0378.i.i
  %most.3.1.i.i = select i1 %.356.i.i, double %.347.sink.i358.i.i, double %most.2.0378.i.i
  %deepest.3.1.i.i = select i1 %.356.i.i, i64 %.161.0377.i.i, i64 %deepest.2.0379.i.i
  %.217.i.i = icmp ugt i64 %.164.0376.i.i, 1
  br i1 %.217.i.i, label %B90.if.i.i, label %B166.i.i

B206.if.i.i:
  %run.3.0382.i.i = phi i64 [ %.410.i.i, %B182.i.i ], [ %run.4.2.i.i, %B398.i.i ]
  %.450.i.i = phi i1 [ true, %B182.i.i ], [ false, %B398.i.i ]
  %.425.0381.off0.i.i = phi i64 [ 1, %B182.i.i ], [ %.174.i.i, %B398.i.i ]
  %.501.i.i = add nsw i64 %.425.0381.off0.i.i, %deepest.2.0.lcssa.i.i
  %30 = or i64 %.501.i.i, %count.2.0823.i
  %31 = icmp ult i64 %30, 4294967296
  br i1 %31, label %32, label %36

32:
  %33 = trunc i64 %.501.i.i to i32
  %34 = urem i32 %33, %24
  %35 = zext i32 %34 to i64
  br label %B208.else.endif.i.i

36:
  %37 = srem i64 %.501.i.i, %count.2.0823.i
  br label %B208.else.endif.i.i

B208.else.endif.i.i:
  %38 = phi i64 [ %35, %32 ], [ %37, %36 ]
  %.524.i.i = icmp slt i64 %38, 0
  %.533.i.i = select i1 %.524.i.i, i64 %count.2.0823.i, i64 0
  %.513.0.i.i = add nsw i64 %.533.i.i, %38
  %.548.not.i.i = icmp eq i64 %.513.0.i.i, %deepest.2.0.lcssa.i.i
  br i1 %.548.not.i.i, label %B398.i.i, label %B238.i.i

39:
  %40 = trunc i64 %.667.i.i to i32
  %41 = urem i32 %40, %24
  %42 = zext i32 %41 to i64
  br label %B296.else.endif.i.i

43:
  %44 = srem i64 %.667.i.i, %count.2.0823.i
  br label %B296.else.endif.i.i

B296.else.endif.i.i:
  %45 = phi i64 [ %42, %39 ], [ %44, %43 ]
  %.692.i.i = icmp slt i64 %45, 0
  %.701.i.i = select i1 %.692.i.i, i64 %count.2.0823.i, i64 0
  %.681.0.i.i = add nsw i64 %.701.i.i, %45
  %.716.not.i.i = icmp eq i64 %.681.0.i.i, %deepest.2.0.lcssa.i.i
  br i1 %.716.not.i.i, label %B398.i.i, label %B340.i.i

B138.endif.i:
  %storemerge.i.i = phi i64 [ 0, %B166.i.i ], [ %run.4.2.i.i, %B398.i.i ]
  %notmask.i = shl nsw i64 -1, %count.2.0823.i
  %46 = xor i64 %storemerge.i.i, %notmask.i
  %.495.i = icmp eq i64 %46, -1
  br i1 %.495.i, label %B727.i, label %B204.i

B302.if.i:
  %kept.3.2815.i = phi i64 [ 0, %B302.if.lr.ph.i ], [ %kept.4.3.i, %B626.i ]
  %free.4.2814.i = phi i64 [ %free.2.0822.i, %B302.if.lr.ph.i ], [ %free.5.3.i, %B626.i ]
  %.592.0813.i = phi i64 [ %count.2.0823.i, %B302.if.lr.ph.i ], [ %.654.i, %B626.i ]
  %.589.0812.i = phi i64 [ 0, %B302.if.lr.ph.i ], [ %.658.i, %B626.i ]
  %.654.i = add nsw i64 %.592.0813.i, -1
  %.658.i = add nuw nsw i64 %.589.0812.i, 1
  %47 = or i64 %.658.i, %count.2.0823.i
  %48 = icmp ult i64 %47, 4294967296
  br i1 %48, label %49, label %53

49:
  %50 = trunc i64 %.658.i to i32
  %51 = urem i32 %50, %10
  %52 = zext i32 %51 to i64
  br label %B304.else.endif.i

53:
  %54 = icmp eq i64 %.658.i, %count.2.0823.i
  %iv.rem.i = select i1 %54, i64 0, i64 %.658.i
  br label %B304.else.endif.i

B304.else.endif.i:
  %55 = phi i64 [ %52, %49 ], [ %iv.rem.i, %53 ]
  %56 = getelementptr i64, ptr %0, i64 %.589.0812.i
  %.779.i = load i64, ptr %56, align 8, !alias.scope !18, !noalias !20
  %57 = getelementptr i64, ptr %0, i64 %55
  %.830.i = load i64, ptr %57, align 8, !alias.scope !18, !noalias !20
  %.838605.i = lshr i64 %storemerge.i.i, %.589.0812.i
  %.839.i = and i64 %.838605.i, 1
  %.841606.i = lshr i64 %storemerge.i.i, %55
  %.842.i536 = and i64 %.841606.i, 1
  %.850.not.i = icmp eq i64 %.839.i, 0
  br i1 %.850.not.i, label %B422.i, label %B398.i537

B662.if.i:
  %.1233.0819.i = phi i64 [ %.1295.i, %B662.if.i ], [ %kept.4.3.i, %B628.i ]
  %.1230.0818.i = phi i64 [ %.1299.i, %B662.if.i ], [ 0, %B628.i ]
  %.1295.i = add nsw i64 %.1233.0819.i, -1
  %.1299.i = add nuw nsw i64 %.1230.0818.i, 1
  %.1373.i = getelementptr i64, ptr %1, i64 %.1230.0818.i
  %.1374.i = load i64, ptr %.1373.i, align 8, !alias.scope !18, !noalias !20
  %.1424.i = getelementptr i64, ptr %0, i64 %.1230.0818.i
  store i64 %.1374.i, ptr %.1424.i, align 8, !alias.scope !18, !noalias !20
  %.1286.i = icmp ugt i64 %.1233.0819.i, 1
  br i1 %.1286.i, label %B662.if.i, label %B698.i

B480:
  %.49.i = icmp slt i64 %.940, 0
  %.50.i = select i1 %.49.i, i64 %arg.clip.5.0, i64 0
  %.51.i = add i64 %.50.i, %.940
  %.71.i = mul i64 %.51.i, %arg.clip.5.1
  %58 = getelementptr double, ptr %arg.clip.4, i64 %.71.i
  %.75.i = getelementptr i8, ptr %58, i64 24
  %.76.i = load double, ptr %.75.i, align 8, !alias.scope !101, !noalias !104
  %.77.i = fmul double %.76.i, 1.600000e+01
  %.82.i = fcmp ogt double %.77.i, 0.000000e+00
  br i1 %.82.i, label %B52.i, label %B592

B52.i:
  %.141.i = load double, ptr %58, align 8, !alias.scope !101, !noalias !104
  %.142.i539 = tail call double @llvm.fabs.f64(double %.141.i)
  %.144.i = fcmp ugt double %.142.i539, %.77.i
  br i1 %.144.i, label %B592, label %placed.2.exit

placed.2.exit:
  %.203.i = getelementptr i8, ptr %58, i64 8
  %.204.i = load double, ptr %.203.i, align 8, !alias.scope !101, !noalias !104
  %.207.i = tail call double @llvm.fabs.f64(double %.204.i)
  %.209.i = fcmp ugt double %.207.i, %.77.i
  br i1 %.209.i, label %B592, label %B512

B512:
  %.49.i540 = icmp slt i64 %.992, 0
  %.50.i541 = select i1 %.49.i540, i64 %arg.clip.5.0, i64 0
  %.51.i542 = add i64 %.50.i541, %.992
  %.71.i543 = mul i64 %.51.i542, %arg.clip.5.1
  %59 = getelementptr double, ptr %arg.clip.4, i64 %.71.i543
  %.75.i544 = getelementptr i8, ptr %59, i64 24
  %.76.i545 = load double, ptr %.75.i544, align 8, !alias.scope !106, !noalias !109
  %.77.i546 = fmul double %.76.i545, 1.600000e+01
  %.82.i547 = fcmp ogt double %.77.i546, 0.000000e+00
  br i1 %.82.i547, label %B52.i550, label %B592

B52.i550:
  %.141.i551 = load double, ptr %59, align 8, !alias.scope !106, !noalias !109
  %.142.i552 = tail call double @llvm.fabs.f64(double %.141.i551)
  %.144.i553 = fcmp ugt double %.142.i552, %.77.i546
  br i1 %.144.i553, label %B592, label %placed.2.exit559

placed.2.exit559:
  %.203.i555 = getelementptr i8, ptr %59, i64 8
  %.204.i556 = load double, ptr %.203.i555, align 8, !alias.scope !106, !noalias !109
  %.207.i557 = tail call double @llvm.fabs.f64(double %.204.i556)
  %.209.i558 = fcmp ugt double %.207.i557, %.77.i546
  br i1 %.209.i558, label %B592, label %B544

B544:
  tail call void @llvm.experimental.noalias.scope.decl(metadata !111)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !114)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !116)
  %.87.i562 = load i32, ptr %.86.i, align 4, !alias.scope !111, !noalias !118
  %.88.i563 = sext i32 %.87.i562 to i64
  %.118.i = load i32, ptr %.117.i, align 4, !alias.scope !114, !noalias !120
  %.119.i564 = sext i32 %.118.i to i64
  %.140.i = select i1 %.49.i, i64 %arg.window_x.5.0, i64 0
  %60 = getelementptr i32, ptr %arg.window_x.4, i64 %.940
  %.154.i = getelementptr i32, ptr %60, i64 %.140.i
  %.155.i = load i32, ptr %.154.i, align 4, !alias.scope !111, !noalias !118
  %.156.i = sext i32 %.155.i to i64
  %.171.i = select i1 %.49.i, i64 %arg.window_y.5.0, i64 0
  %61 = getelementptr i32, ptr %arg.window_y.4, i64 %.940
  %.185.i = getelementptr i32, ptr %61, i64 %.171.i
  %.186.i = load i32, ptr %.185.i, align 4, !alias.scope !114, !noalias !120
  %.187.i = sext i32 %.186.i to i64
  %.208.i = select i1 %.49.i540, i64 %arg.window_x.5.0, i64 0
  %62 = getelementptr i32, ptr %arg.window_x.4, i64 %.992
  %.222.i = getelementptr i32, ptr %62, i64 %.208.i
  %.223.i = load i32, ptr %.222.i, align 4, !alias.scope !111, !noalias !118
  %.224.i566 = sext i32 %.223.i to i64
  %.239.i = select i1 %.49.i540, i64 %arg.window_y.5.0, i64 0
  %63 = getelementptr i32, ptr %arg.window_y.4, i64 %.992
  %.253.i = getelementptr i32, ptr %63, i64 %.239.i
  %.254.i = load i32, ptr %.253.i, align 4, !alias.scope !114, !noalias !120
  %.255.i567 = sext i32 %.254.i to i64
  %.264.i = sub nsw i64 %.156.i, %.88.i563
  %.267.i = sub nsw i64 %.255.i567, %.119.i564
  %.268.i = mul nsw i64 %.267.i, %.264.i
  %.271.i = sub nsw i64 %.224.i566, %.88.i563
  %.274.neg.i = sub nsw i64 %.119.i564, %.187.i
  %.275.neg.i = mul i64 %.271.i, %.274.neg.i
  %.276.i = add i64 %.268.i, %.275.neg.i
  %.281.i568 = icmp eq i64 %.276.i, 0
  br i1 %.281.i568, label %B592, label %B374.i569

B374.i569:
  %.284.i = icmp slt i64 %.276.i, 0
  %or.cond.i571 = select i1 %.284.i, i1 %.287.i570, i1 false
  %.290.i573 = icmp sgt i64 %.276.i, 0
  %or.cond461.i = select i1 %.290.i573, i1 %.293.i574, i1 false
  %or.cond690 = select i1 %or.cond.i571, i1 true, i1 %or.cond461.i
  br i1 %or.cond690, label %B592, label %B426.i575

B426.i575:
  %.14.i.i576 = tail call i64 @llvm.smin.i64(i64 %.156.i, i64 %.88.i563)
  %.16.i.i577 = tail call i64 @llvm.smin.i64(i64 %.224.i566, i64 %.14.i.i576)
  %.367.i = add nsw i64 %.16.i.i577, 127
  %.368.i = ashr i64 %.367.i, 8
  %.14.i464.i = tail call i64 @llvm.smax.i64(i64 %.156.i, i64 %.88.i563)
  %.16.i465.i = tail call i64 @llvm.smax.i64(i64 %.224.i566, i64 %.14.i464.i)
  %.402.i = add nsw i64 %.16.i465.i, -128
  %.403.i = ashr i64 %.402.i, 8
  %.14.i466.i = tail call i64 @llvm.smin.i64(i64 %.187.i, i64 %.119.i564)
  %.16.i467.i = tail call i64 @llvm.smin.i64(i64 %.255.i567, i64 %.14.i466.i)
  %.437.i = add nsw i64 %.16.i467.i, 127
  %.438.i = ashr i64 %.437.i, 8
  %.14.i468.i = tail call i64 @llvm.smax.i64(i64 %.187.i, i64 %.119.i564)
  %.16.i469.i = tail call i64 @llvm.smax.i64(i64 %.255.i567, i64 %.14.i468.i)
  %.472.i = add nsw i64 %.16.i469.i, -128
  %.473.i = ashr i64 %.472.i, 8
  %.11.i.i578 = tail call i64 @llvm.smax.i64(i64 %.368.i, i64 0)
  %.11.i470.i = tail call i64 @llvm.smax.i64(i64 %.438.i, i64 0)
  %.11.i471.i = tail call i64 @llvm.smin.i64(i64 %.537.i, i64 %.403.i)
  %.11.i472.i = tail call i64 @llvm.smin.i64(i64 %.569.i, i64 %.473.i)
  %.608.i = icmp sgt i64 %.11.i.i578, %.11.i471.i
  %.612.i = icmp sgt i64 %.11.i470.i, %.11.i472.i
  %or.cond462.i = select i1 %.608.i, i1 true, i1 %.612.i
  br i1 %or.cond462.i, label %B592, label %B778.i579

B778.i579:
  %.651.i = icmp eq i64 %.11.i.i578, %.11.i471.i
  %.655.i = icmp eq i64 %.11.i470.i, %.11.i472.i
  %or.cond463.i = select i1 %.651.i, i1 %.655.i, i1 false
  br i1 %or.cond463.i, label %B802.i582, label %B908.i580

B802.i582:
  br i1 %.284.i, label %B836.i585, label %B802.B836_crit_edge.i583

B802.B836_crit_edge.i583:
  %.pre.i584 = sub nsw i64 %.187.i, %.119.i564
  br label %B836.i585

B836.i585:
  %.11.i.i.pre-phi.i586 = phi i64 [ %.pre.i584, %B802.B836_crit_edge.i583 ], [ %.267.i, %B802.i582 ]
  %.10.i.i.pre-phi.i587 = phi i64 [ %.264.i, %B802.B836_crit_edge.i583 ], [ %.271.i, %B802.i582 ]
  %y1.2.0.i588 = phi i64 [ %.187.i, %B802.B836_crit_edge.i583 ], [ %.255.i567, %B802.i582 ]
  %x1.2.0.i589 = phi i64 [ %.156.i, %B802.B836_crit_edge.i583 ], [ %.224.i566, %B802.i582 ]
  %y2.2.0.i590 = phi i64 [ %.255.i567, %B802.B836_crit_edge.i583 ], [ %.187.i, %B802.i582 ]
  %x2.2.0.i591 = phi i64 [ %.224.i566, %B802.B836_crit_edge.i583 ], [ %.156.i, %B802.i582 ]
  %.715.i = shl nuw nsw i64 %.11.i.i578, 8
  %.716.i = or i64 %.715.i, 128
  %.718.i = shl nuw nsw i64 %.11.i470.i, 8
  %.719.i = or i64 %.718.i, 128
  %.26.i.i.i592 = icmp sgt i64 %.11.i.i.pre-phi.i586, -1
  %.32.i.i.i593 = icmp ne i64 %y1.2.0.i588, %.119.i564
  %.37.i.i.i594 = icmp slt i64 %.10.i.i.pre-phi.i587, 1
  %or.cond.not.i.i.i595 = or i1 %.37.i.i.i594, %.32.i.i.i593
  %narrow.i.i.i596 = and i1 %.26.i.i.i592, %or.cond.not.i.i.i595
  %"$phi98.1.2.0.neg.i.i.i597" = sext i1 %narrow.i.i.i596 to i64
  %.18.i.i.i598 = sub nsw i64 %.719.i, %.119.i564
  %.20.i.i.i599 = mul nsw i64 %.10.i.i.pre-phi.i587, %.18.i.i.i598
  %.21.neg.i.i.i600 = sub nsw i64 %.88.i563, %.716.i
  %.23.neg.i.i.i601 = mul i64 %.11.i.i.pre-phi.i586, %.21.neg.i.i.i600
  %.24.i.i.i602 = add i64 %.20.i.i.i599, %.23.neg.i.i.i601
  %.56.i.i.i603 = add i64 %.24.i.i.i602, %"$phi98.1.2.0.neg.i.i.i597"
  %.61.i.i604 = icmp sgt i64 %.56.i.i.i603, -1
  br i1 %.61.i.i604, label %B52.i.i605, label %B592

B52.i.i605:
  %.10.i29.i.i606 = sub nsw i64 %x2.2.0.i591, %x1.2.0.i589
  %.11.i30.i.i607 = sub nsw i64 %y2.2.0.i590, %y1.2.0.i588
  %.26.i31.i.i608 = icmp sgt i64 %.11.i30.i.i607, -1
  %.32.i32.i.i609 = icmp ne i32 %.186.i, %.254.i
  %.37.i33.i.i610 = icmp slt i64 %.10.i29.i.i606, 1
  %or.cond.not.i34.i.i611 = or i1 %.32.i32.i.i609, %.37.i33.i.i610
  %narrow.i35.i.i612 = and i1 %.26.i31.i.i608, %or.cond.not.i34.i.i611
  %"$phi98.1.2.0.neg.i36.i.i613" = sext i1 %narrow.i35.i.i612 to i64
  %.18.i37.i.i614 = sub nsw i64 %.719.i, %y1.2.0.i588
  %.20.i38.i.i615 = mul nsw i64 %.10.i29.i.i606, %.18.i37.i.i614
  %.21.neg.i39.i.i616 = sub nsw i64 %x1.2.0.i589, %.716.i
  %.23.neg.i40.i.i617 = mul i64 %.11.i30.i.i607, %.21.neg.i39.i.i616
  %.24.i41.i.i618 = add i64 %.20.i38.i.i615, %.23.neg.i40.i.i617
  %.56.i42.i.i619 = add i64 %.24.i41.i.i618, %"$phi98.1.2.0.neg.i36.i.i613"
  %.101.i.i620 = icmp sgt i64 %.56.i42.i.i619, -1
  br i1 %.101.i.i620, label %holds.2.exit.i621, label %B592

holds.2.exit.i621:
  %.10.i43.i.i622 = sub nsw i64 %.88.i563, %x2.2.0.i591
  %.11.i44.i.i623 = sub nsw i64 %.119.i564, %y2.2.0.i590
  %.26.i45.i.i624 = icmp sgt i64 %.11.i44.i.i623, -1
  %.32.i46.i.i625 = icmp ne i64 %y2.2.0.i590, %.119.i564
  %.37.i47.i.i626 = icmp slt i64 %.10.i43.i.i622, 1
  %or.cond.not.i48.i.i627 = or i1 %.32.i46.i.i625, %.37.i47.i.i626
  %narrow.i49.i.i628 = and i1 %.26.i45.i.i624, %or.cond.not.i48.i.i627
  %"$phi98.1.2.0.neg.i50.i.i629" = sext i1 %narrow.i49.i.i628 to i64
  %.18.i51.i.i630 = sub nsw i64 %.719.i, %y2.2.0.i590
  %.20.i52.i.i631 = mul nsw i64 %.10.i43.i.i622, %.18.i51.i.i630
  %.21.neg.i53.i.i632 = sub nsw i64 %x2.2.0.i591, %.716.i
  %.23.neg.i54.i.i633 = mul i64 %.21.neg.i53.i.i632, %.11.i44.i.i623
  %.24.i55.i.i634 = add i64 %.20.i52.i.i631, %.23.neg.i54.i.i633
  %.56.i56.i.i635 = add i64 %.24.i55.i.i634, %"$phi98.1.2.0.neg.i50.i.i629"
  %.148.i.i636 = icmp slt i64 %.56.i56.i.i635, 0
  br i1 %.148.i.i636, label %B592, label %B908.i580

B908.i580:
  %.835.i = icmp slt i64 %at.6.2683, 0
  %.836.i = select i1 %.835.i, i64 %arg.ready.5.0, i64 0
  %.837.i = add i64 %.836.i, %at.6.2683
  %.857.i = mul i64 %.837.i, %arg.ready.5.1
  %.861.i = getelementptr i32, ptr %arg.ready.4, i64 %.857.i
  store i32 %.862.i, ptr %.861.i, align 4, !alias.scope !116, !noalias !121
  %extract.t.i = trunc i64 %.992 to i32
  %extract.t458.i = trunc i64 %.940 to i32
  %"$phi940.0.2.0.off0.i" = select i1 %.284.i, i32 %extract.t.i, i32 %extract.t458.i
  %.932.i = getelementptr i8, ptr %.861.i, i64 4
  store i32 %"$phi940.0.2.0.off0.i", ptr %.932.i, align 4, !alias.scope !116, !noalias !121
  %"$phi970.0.2.0.off0.i" = select i1 %.284.i, i32 %extract.t458.i, i32 %extract.t.i
  %.1011.i = getelementptr i8, ptr %.861.i, i64 8
  store i32 %"$phi970.0.2.0.off0.i", ptr %.1011.i, align 4, !alias.scope !116, !noalias !121
  %.276.lobit.i = lshr i64 %.276.i, 63
  %"$phi1000.0.2.0.off0.i581" = trunc i64 %.276.lobit.i to i32
  %.1082.i = getelementptr i8, ptr %.861.i, i64 12
  store i32 %"$phi1000.0.2.0.off0.i581", ptr %.1082.i, align 4, !alias.scope !116, !noalias !121
  %.1160.i = getelementptr i8, ptr %.861.i, i64 16
  %.1161.i = trunc i64 %.11.i.i578 to i32
  store i32 %.1161.i, ptr %.1160.i, align 4, !alias.scope !116, !noalias !121
  %.1216.i = getelementptr i8, ptr %.861.i, i64 20
  %.1217.i = trunc i64 %.11.i470.i to i32
  store i32 %.1217.i, ptr %.1216.i, align 4, !alias.scope !116, !noalias !121
  %.1272.i = getelementptr i8, ptr %.861.i, i64 24
  %.1273.i = trunc i64 %.11.i471.i to i32
  store i32 %.1273.i, ptr %.1272.i, align 4, !alias.scope !116, !noalias !121
  %.1328.i = getelementptr i8, ptr %.861.i, i64 28
  %.1329.i = trunc i64 %.11.i472.i to i32
  store i32 %.1329.i, ptr %.1328.i, align 4, !alias.scope !116, !noalias !121
  %.1334.i = add nsw i64 %at.6.2683, 1
  br label %B592

B592:
  %at.7.3 = phi i64 [ %at.6.2683, %B480 ], [ %at.6.2683, %placed.2.exit559 ], [ %at.6.2683, %placed.2.exit ], [ %at.6.2683, %placed.2.exit667 ], [ %at.6.2683, %B512 ], [ %.1334.i, %B908.i580 ], [ %at.6.2683, %B426.i575 ], [ %at.6.2683, %B544 ], [ %at.6.2683, %B378.if ], [ %at.6.2683, %B374.i569 ], [ %at.6.2683, %B836.i585 ], [ %at.6.2683, %B52.i.i605 ], [ %at.6.2683, %holds.2.exit.i621 ], [ %at.6.2683, %B52.i ], [ %at.6.2683, %B52.i550 ], [ %at.6.2683, %B52.i658 ]
  %.789 = icmp ugt i64 %.730.0682, 1
  br i1 %.789, label %B378.if, label %B599

common.ret:
  %at.3.0.lcssa = phi i64 [ %arg.at, %entry ], [ %at.4.1, %B599 ]
  store i64 %at.3.0.lcssa, ptr %retptr, align 8
  ret i32 0

B599:
  %free.3.1 = phi i64 [ %free.2.0688, %B58.if ], [ %free.2.0688, %B908.i ], [ %free.2.0688, %B96 ], [ %free.2.0688, %B374.i ], [ %free.2.0688, %holds.2.exit.i ], [ %free.2.0688, %B426.i ], [ %free.2.0688, %B836.i ], [ %free.2.0688, %B52.i.i ], [ %free.3.1.lcssa.sink.i, %project.2.exit ], [ %free.3.1.lcssa.sink.i, %B592 ]
  %at.4.1 = phi i64 [ %at.3.0687, %B58.if ], [ %.1337.i, %B908.i ], [ %at.3.0687, %B96 ], [ %at.3.0687, %B374.i ], [ %at.3.0687, %holds.2.exit.i ], [ %at.3.0687, %B426.i ], [ %at.3.0687, %B836.i ], [ %at.3.0687, %B52.i.i ], [ %at.3.0687, %project.2.exit ], [ %at.7.3, %B592 ]
  %.251 = icmp sgt i64 %.195.0685, 1
  br i1 %.251, label %B58.if, label %common.ret

B58.if:
  %free.2.0688 = phi i64 [ %arg.free, %B58.if.lr.ph ], [ %free.3.1, %B599 ]
  %at.3.0687 = phi i64 [ %arg.at, %B58.if.lr.ph ], [ %at.4.1, %B599 ]
  %.192.0686 = phi i64 [ %arg.first, %B58.if.lr.ph ], [ %.264, %B599 ]
  %.195.0685 = phi i64 [ %.205, %B58.if.lr.ph ], [ %.260, %B599 ]
  %.260 = add nsw i64 %.195.0685, -1
  %.264 = add i64 %.192.0686, 1
  %.306 = icmp slt i64 %.192.0686, 0
  %.307 = select i1 %.306, i64 %arg.kinds.5.0, i64 0
  %64 = getelementptr i8, ptr %arg.kinds.4, i64 %.192.0686
  %.321 = getelementptr i8, ptr %64, i64 %.307
  %.322 = load i8, ptr %.321, align 1
  switch i8 %.322, label %B599 [
    i8 1, label %B96
    i8 2, label %B240
  ]

B240.endif:
  %count.3.1.lcssa.sink.i = phi i64 [ 0, %B698.i ], [ 0, %B204.i ], [ 0, %B628.i ], [ %count.3.1.i, %B727.i ]
  %free.3.1.lcssa.sink.i = phi i64 [ %free.5.3.i, %B698.i ], [ %free.2.0822.i, %B204.i ], [ %free.5.3.i, %B628.i ], [ %free.3.1.i, %B727.i ]
  tail call void @llvm.experimental.noalias.scope.decl(metadata !122)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !125)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !127)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !129)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !131)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !133)
  %.118.i637 = sub i64 %free.3.1.lcssa.sink.i, %free.2.0688
  %.164289.not.i = icmp slt i64 %.118.i637, 1
  br i1 %.164289.not.i, label %project.2.exit, label %B38.if.i

B290.i:
  %.563.i = tail call double @llvm.fabs.f64(double %.259.i639)
  %.565.i = fmul double %.424.i, 8.000000e+00
  %.566.i = fcmp ugt double %.563.i, %.565.i
  %.573.i = tail call double @llvm.fabs.f64(double %.314.i)
  %.576.i = fcmp ugt double %.573.i, %.565.i
  %extract.t273.i = trunc i64 %.553.i to i8
  %or.cond.i647 = select i1 %.566.i, i1 true, i1 %.576.i
  br i1 %or.cond.i647, label %B378.i, label %B398.i643

B378.i:
  %.pre294.pre-phi.i = phi double [ %.pre.i642, %B38.if.B378_crit_edge.i ], [ %.573.i, %B290.i ]
  %.pre.pre-phi.i = phi double [ %.pre298.i, %B38.if.B378_crit_edge.i ], [ %.563.i, %B290.i ]
  %.pre-phi297.i = phi i8 [ %.pre296.i, %B38.if.B378_crit_edge.i ], [ %extract.t273.i, %B290.i ]
  %extract.t274.i = or i8 %.pre-phi297.i, 64
  br label %B398.i643

B398.i643:
  %.pre-phi295.i = phi double [ %.573.i, %B290.i ], [ %.pre294.pre-phi.i, %B378.i ]
  %.pre-phi.i = phi double [ %.563.i, %B290.i ], [ %.pre.pre-phi.i, %B378.i ]
  %code.4.2.off0.i = phi i8 [ %extract.t273.i, %B290.i ], [ %extract.t274.i, %B378.i ]
  %65 = fcmp ueq double %.pre-phi.i, 0x7FF0000000000000
  %66 = fcmp ueq double %.pre-phi295.i, 0x7FF0000000000000
  %or.cond276.i = select i1 %65, i1 true, i1 %66
  %67 = tail call double @llvm.fabs.f64(double %.369.i)
  %68 = fcmp ueq double %67, 0x7FF0000000000000
  %or.cond278.i = select i1 %or.cond276.i, i1 true, i1 %68
  %69 = tail call double @llvm.fabs.f64(double %.424.i)
  %70 = fcmp ueq double %69, 0x7FF0000000000000
  %or.cond280.i = or i1 %70, %or.cond278.i
  %extract.t272.i = or i8 %code.4.2.off0.i, -128
  %code.5.2.off0.i = select i1 %or.cond280.i, i8 %extract.t272.i, i8 %code.4.2.off0.i
  %.632.i = select i1 %.232.i, i64 %arg.codes.5.0, i64 0
  %71 = getelementptr i8, ptr %arg.codes.4, i64 %.105.0291.i
  %.646.i = getelementptr i8, ptr %71, i64 %.632.i
  store i8 %code.5.2.off0.i, ptr %.646.i, align 1, !alias.scope !133, !noalias !135
  br i1 %.560.i, label %B672.i, label %B1052.i

B672.i:
  %.660.i = fdiv double %.259.i639, %.424.i
  %.663.i = fmul double %.660.i, 5.000000e-01
  %.664.i = fadd double %.663.i, 5.000000e-01
  %.667.i = fmul double %.664.i, %.666.i
  %.668.i = fmul double %.667.i, 2.560000e+02
  %.676.le.i = tail call double @llvm.rint.f64(double %.668.i)
  %.10.i.i = fcmp olt double %.676.le.i, -1.000000e+09
  %.11.i.i644 = select i1 %.10.i.i, double -1.000000e+09, double %.676.le.i
  %.10.i281.i = fcmp ogt double %.11.i.i644, 1.000000e+09
  %.11.i282.i = select i1 %.10.i281.i, double 1.000000e+09, double %.11.i.i644
  %.737.i = fptosi double %.11.i282.i to i32
  %.753.i = select i1 %.232.i, i64 %arg.window_x.5.0, i64 0
  %72 = getelementptr i32, ptr %arg.window_x.4, i64 %.105.0291.i
  %.767.i = getelementptr i32, ptr %72, i64 %.753.i
  store i32 %.737.i, ptr %.767.i, align 4, !alias.scope !125, !noalias !137
  %.774.i = fdiv double %.314.i, %.424.i
  %.777.i = fmul double %.774.i, 5.000000e-01
  %.778.i = fsub double 5.000000e-01, %.777.i
  %.781.i = fmul double %.778.i, %.780.i
  %.782.i = fmul double %.781.i, 2.560000e+02
  %.790.le.i = tail call double @llvm.rint.f64(double %.782.i)
  %.10.i283.i = fcmp olt double %.790.le.i, -1.000000e+09
  %.11.i284.i = select i1 %.10.i283.i, double -1.000000e+09, double %.790.le.i
  %.10.i285.i = fcmp ogt double %.11.i284.i, 1.000000e+09
  %.11.i286.i = select i1 %.10.i285.i, double 1.000000e+09, double %.11.i284.i
  %.851.i = fptosi double %.11.i286.i to i32
  %.867.i645 = select i1 %.232.i, i64 %arg.window_y.5.0, i64 0
  %73 = getelementptr i32, ptr %arg.window_y.4, i64 %.105.0291.i
  %.881.i646 = getelementptr i32, ptr %73, i64 %.867.i645
  store i32 %.851.i, ptr %.881.i646, align 4, !alias.scope !127, !noalias !138
  %.888.i = fdiv double %.369.i, %.424.i
  %.891.i = fmul double %.888.i, 5.000000e-01
  %.892.i = fadd double %.891.i, 5.000000e-01
  %.908.i = select i1 %.232.i, i64 %arg.depth.5.0, i64 0
  %74 = getelementptr double, ptr %arg.depth.4, i64 %.105.0291.i
  %.922.i = getelementptr double, ptr %74, i64 %.908.i
  store double %.892.i, ptr %.922.i, align 8, !alias.scope !129, !noalias !139
  %.928.i = fdiv double 1.000000e+00, %.424.i
  %.946.i = select i1 %.232.i, i64 %arg.inverse_w.5.0, i64 0
  %75 = getelementptr double, ptr %arg.inverse_w.4, i64 %.105.0291.i
  %.960.i = getelementptr double, ptr %75, i64 %.946.i
  store double %.928.i, ptr %.960.i, align 8, !alias.scope !131, !noalias !140
  br label %B1052.i

B1052.i:
  %.164.i = icmp ugt i64 %.108.0290.i, 1
  br i1 %.164.i, label %B38.if.i, label %project.2.exit

B38.if.i:
  %.105.0291.i = phi i64 [ %.177.i, %B1052.i ], [ %free.2.0688, %B240.endif ]
  %.108.0290.i = phi i64 [ %.173.i, %B1052.i ], [ %.118.i637, %B240.endif ]
  %.173.i = add nsw i64 %.108.0290.i, -1
  %.177.i = add i64 %.105.0291.i, 1
  %.232.i = icmp slt i64 %.105.0291.i, 0
  %.233.i = select i1 %.232.i, i64 %arg.clip.5.0, i64 0
  %.234.i = add i64 %.233.i, %.105.0291.i
  %.254.i638 = mul i64 %.234.i, %arg.clip.5.1
  %.258.i = getelementptr double, ptr %arg.clip.4, i64 %.254.i638
  %.259.i639 = load double, ptr %.258.i, align 8, !alias.scope !122, !noalias !141
  %.313.i = getelementptr i8, ptr %.258.i, i64 8
  %.314.i = load double, ptr %.313.i, align 8, !alias.scope !122, !noalias !141
  %.368.i640 = getelementptr i8, ptr %.258.i, i64 16
  %.369.i = load double, ptr %.368.i640, align 8, !alias.scope !122, !noalias !141
  %.423.i = getelementptr i8, ptr %.258.i, i64 24
  %.424.i = load double, ptr %.423.i, align 8, !alias.scope !122, !noalias !141
  %.447.i = fadd double %.369.i, %.424.i
  %.448.i = fcmp ult double %.447.i, 0.000000e+00
  %..i = zext i1 %.448.i to i64
  %.459.i = fsub double %.424.i, %.369.i
  %.460.i = fcmp ult double %.459.i, 0.000000e+00
  %"$phi176.2.2.1.i" = select i1 %.460.i, i64 2, i64 0
  %.478.i641 = fcmp ogt double %.259.i639, %.424.i
  %"$phi222.2.2.1.i" = select i1 %.478.i641, i64 4, i64 0
  %.491.i = fneg double %.424.i
  %.493.i = fcmp olt double %.259.i639, %.491.i
  %"$phi222.3.2.1.i" = select i1 %.493.i, i64 8, i64 0
  %.504.i = or i64 %"$phi222.2.2.1.i", %"$phi222.3.2.1.i"
  %.511.i = fcmp ogt double %.314.i, %.424.i
  %"$phi244.3.2.1.i" = select i1 %.511.i, i64 16, i64 0
  %.525.i = or i64 %.504.i, %"$phi244.3.2.1.i"
  %.533.i = fcmp olt double %.314.i, %.491.i
  %"$phi268.3.2.1.i" = select i1 %.533.i, i64 32, i64 0
  %.547.i = or i64 %.525.i, %"$phi268.3.2.1.i"
  %.471.i = or i64 %.547.i, %..i
  %.553.i = or i64 %.471.i, %"$phi176.2.2.1.i"
  %.560.i = fcmp ogt double %.424.i, 0.000000e+00
  br i1 %.560.i, label %B290.i, label %B38.if.B378_crit_edge.i

B38.if.B378_crit_edge.i:
  %.pre296.i = trunc i64 %.553.i to i8
  %.pre298.i = tail call double @llvm.fabs.f64(double %.259.i639)
  %.pre.i642 = tail call double @llvm.fabs.f64(double %.314.i)
  br label %B378.i

project.2.exit:
  %.789680.not = icmp slt i64 %count.3.1.lcssa.sink.i, 3
  br i1 %.789680.not, label %B599, label %B378.if.lr.ph

B378.if.lr.ph:
  %.740 = add nsw i64 %count.3.1.lcssa.sink.i, -2
  %.889 = load i64, ptr %0, align 8
  %.49.i648 = icmp slt i64 %.889, 0
  %.50.i649 = select i1 %.49.i648, i64 %arg.clip.5.0, i64 0
  %.51.i650 = add i64 %.50.i649, %.889
  %.71.i651 = mul i64 %.51.i650, %arg.clip.5.1
  %76 = getelementptr double, ptr %arg.clip.4, i64 %.71.i651
  %.75.i652 = getelementptr i8, ptr %76, i64 24
  %.76.i653 = load double, ptr %.75.i652, align 8, !alias.scope !142, !noalias !145
  %.77.i654 = fmul double %.76.i653, 1.600000e+01
  %.82.i655 = fcmp ogt double %.77.i654, 0.000000e+00
  %.203.i663 = getelementptr i8, ptr %76, i64 8
  %.72.i561 = select i1 %.49.i648, i64 %arg.window_x.5.0, i64 0
  %77 = getelementptr i32, ptr %arg.window_x.4, i64 %.889
  %.86.i = getelementptr i32, ptr %77, i64 %.72.i561
  %.103.i = select i1 %.49.i648, i64 %arg.window_y.5.0, i64 0
  %78 = getelementptr i32, ptr %arg.window_y.4, i64 %.889
  %.117.i = getelementptr i32, ptr %78, i64 %.103.i
  %.862.i = trunc i64 %.889 to i32
  br label %B378.if

B378.if:
  %at.6.2683 = phi i64 [ %at.3.0687, %B378.if.lr.ph ], [ %at.7.3, %B592 ]
  %.730.0682 = phi i64 [ %.740, %B378.if.lr.ph ], [ %.798, %B592 ]
  %.727.0681 = phi i64 [ 1, %B378.if.lr.ph ], [ %.802, %B592 ]
  %.798 = add nsw i64 %.730.0682, -1
  %.802 = add nuw i64 %.727.0681, 1
  %79 = getelementptr i64, ptr %0, i64 %.727.0681
  %.940 = load i64, ptr %79, align 8
  %80 = getelementptr i8, ptr %79, i64 8
  %.992 = load i64, ptr %80, align 8
  br i1 %.82.i655, label %B52.i658, label %B592

B52.i658:
  %.141.i659 = load double, ptr %76, align 8, !alias.scope !142, !noalias !145
  %.142.i660 = tail call double @llvm.fabs.f64(double %.141.i659)
  %.144.i661 = fcmp ugt double %.142.i660, %.77.i654
  br i1 %.144.i661, label %B592, label %placed.2.exit667

placed.2.exit667:
  %.204.i664 = load double, ptr %.203.i663, align 8, !alias.scope !142, !noalias !145
  %.207.i665 = tail call double @llvm.fabs.f64(double %.204.i664)
  %.209.i666 = fcmp ugt double %.207.i665, %.77.i654
  br i1 %.209.i666, label %B592, label %B480
}

declare double @llvm.fabs.f64(double)

declare double @llvm.rint.f64(double)

declare i64 @llvm.smin.i64(i64, i64)

declare i64 @llvm.smax.i64(i64, i64)

declare void @llvm.experimental.noalias.scope.decl(metadata)

!0 = !{!1}
!1 = distinct !{!1, !2, !"keep.3: %arg.window_x.4"}
!2 = distinct !{!2, !"keep.3"}
!3 = !{!4}
!4 = distinct !{!4, !2, !"keep.3: %arg.window_y.4"}
!5 = !{!6}
!6 = distinct !{!6, !2, !"keep.3: %arg.ready.4"}
!7 = !{!8, !4, !6}
!8 = distinct !{!8, !2, !"keep.3: %retptr"}
!9 = !{!8, !1, !6}
!10 = !{!8, !1, !4}
!11 = !{!12}
!12 = distinct !{!12, !13, !"clip.2: %arg.triangles.4"}
!13 = distinct !{!13, !"clip.2"}
!14 = !{!15}
!15 = distinct !{!15, !13, !"clip.2: %arg.clip.4"}
!16 = !{!17}
!17 = distinct !{!17, !13, !"clip.2: %arg.varyings.4"}
!18 = !{!19}
!19 = distinct !{!19, !13, !"clip.2: %arg.corners.4"}
!20 = !{!21, !12, !15, !17}
!21 = distinct !{!21, !13, !"clip.2: %retptr"}
!22 = !{!23, !15}
!23 = distinct !{!23, !24, !"distance.2: %arg.clip.4"}
!24 = distinct !{!24, !"distance.2"}
!25 = !{!26, !21, !12, !17, !19}
!26 = distinct !{!26, !24, !"distance.2: %retptr"}
!27 = !{!28, !15}
!28 = distinct !{!28, !29, !"distance.2: %arg.clip.4:thread"}
!29 = distinct !{!29, !"distance.2"}
!30 = !{!31, !21, !12, !17, !19}
!31 = distinct !{!31, !29, !"distance.2: %retptr:thread"}
!32 = !{!33, !15}
!33 = distinct !{!33, !29, !"distance.2: %arg.clip.4:thread"}
!34 = !{!35, !21, !12, !17, !19}
!35 = distinct !{!35, !29, !"distance.2: %retptr:thread"}
!36 = !{!37, !15}
!37 = distinct !{!37, !29, !"distance.2: %arg.clip.4:thread"}
!38 = !{!39, !21, !12, !17, !19}
!39 = distinct !{!39, !29, !"distance.2: %retptr:thread"}
!40 = !{!41, !15}
!41 = distinct !{!41, !29, !"distance.2: %arg.clip.4:thread"}
!42 = !{!43, !21, !12, !17, !19}
!43 = distinct !{!43, !29, !"distance.2: %retptr:thread"}
!44 = !{!45, !15}
!45 = distinct !{!45, !29, !"distance.2: %arg.clip.4:thread"}
!46 = !{!47, !21, !12, !17, !19}
!47 = distinct !{!47, !29, !"distance.2: %retptr:thread"}
!48 = !{!49, !15}
!49 = distinct !{!49, !29, !"distance.2: %arg.clip.4"}
!50 = !{!51, !21, !12, !17, !19}
!51 = distinct !{!51, !29, !"distance.2: %retptr"}
!52 = !{!53}
!53 = distinct !{!53, !54, !"between.2: %arg.clip.4"}
!54 = distinct !{!54, !"between.2"}
!55 = !{!56}
!56 = distinct !{!56, !54, !"between.2: %arg.varyings.4"}
!57 = !{!53, !15}
!58 = !{!59, !56, !21, !12, !17, !19}
!59 = distinct !{!59, !54, !"between.2: %retptr"}
!60 = !{!56, !17}
!61 = !{!59, !53, !21, !12, !15, !19}
!62 = !{!63}
!63 = distinct !{!63, !64, !"between.2: %arg.clip.4"}
!64 = distinct !{!64, !"between.2"}
!65 = !{!66}
!66 = distinct !{!66, !64, !"between.2: %arg.varyings.4"}
!67 = !{!63, !15}
!68 = !{!69, !66, !21, !12, !17, !19}
!69 = distinct !{!69, !64, !"between.2: %retptr"}
!70 = !{!66, !17}
!71 = !{!69, !63, !21, !12, !15, !19}
!72 = !{!21, !15, !17, !19}
!73 = !{!74}
!74 = distinct !{!74, !75, !"run_inside.2: %arg.clip.4"}
!75 = distinct !{!75, !"run_inside.2"}
!76 = !{!77}
!77 = distinct !{!77, !75, !"run_inside.2: %arg.corners.4"}
!78 = !{!77, !19}
!79 = !{!80, !74, !21, !12, !15, !17}
!80 = distinct !{!80, !75, !"run_inside.2: %retptr"}
!81 = !{!82, !74, !15}
!82 = distinct !{!82, !83, !"distance.2: %arg.clip.4"}
!83 = distinct !{!83, !"distance.2"}
!84 = !{!85, !80, !77, !21, !12, !17, !19}
!85 = distinct !{!85, !83, !"distance.2: %retptr"}
!86 = !{!87, !74, !15}
!87 = distinct !{!87, !88, !"distance.2: %arg.clip.4"}
!88 = distinct !{!88, !"distance.2"}
!89 = !{!90, !80, !77, !21, !12, !17, !19}
!90 = distinct !{!90, !88, !"distance.2: %retptr"}
!91 = !{!92, !74, !15}
!92 = distinct !{!92, !93, !"distance.2: %arg.clip.4"}
!93 = distinct !{!93, !"distance.2"}
!94 = !{!95, !80, !77, !21, !12, !17, !19}
!95 = distinct !{!95, !93, !"distance.2: %retptr"}
!96 = !{!97, !74, !15}
!97 = distinct !{!97, !98, !"distance.2: %arg.clip.4"}
!98 = distinct !{!98, !"distance.2"}
!99 = !{!100, !80, !77, !21, !12, !17, !19}
!100 = distinct !{!100, !98, !"distance.2: %retptr"}
!101 = !{!102}
!102 = distinct !{!102, !103, !"placed.2: %arg.clip.4"}
!103 = distinct !{!103, !"placed.2"}
!104 = !{!105}
!105 = distinct !{!105, !103, !"placed.2: %retptr"}
!106 = !{!107}
!107 = distinct !{!107, !108, !"placed.2: %arg.clip.4"}
!108 = distinct !{!108, !"placed.2"}
!109 = !{!110}
!110 = distinct !{!110, !108, !"placed.2: %retptr"}
!111 = !{!112}
!112 = distinct !{!112, !113, !"keep.4: %arg.window_x.4"}
!113 = distinct !{!113, !"keep.4"}
!114 = !{!115}
!115 = distinct !{!115, !113, !"keep.4: %arg.window_y.4"}
!116 = !{!117}
!117 = distinct !{!117, !113, !"keep.4: %arg.ready.4"}
!118 = !{!119, !115, !117}
!119 = distinct !{!119, !113, !"keep.4: %retptr"}
!120 = !{!119, !112, !117}
!121 = !{!119, !112, !115}
!122 = !{!123}
!123 = distinct !{!123, !124, !"project.2: %arg.clip.4"}
!124 = distinct !{!124, !"project.2"}
!125 = !{!126}
!126 = distinct !{!126, !124, !"project.2: %arg.window_x.4"}
!127 = !{!128}
!128 = distinct !{!128, !124, !"project.2: %arg.window_y.4"}
!129 = !{!130}
!130 = distinct !{!130, !124, !"project.2: %arg.depth.4"}
!131 = !{!132}
!132 = distinct !{!132, !124, !"project.2: %arg.inverse_w.4"}
!133 = !{!134}
!134 = distinct !{!134, !124, !"project.2: %arg.codes.4"}
!135 = !{!136, !123, !126, !128, !130, !132}
!136 = distinct !{!136, !124, !"project.2: %retptr"}
!137 = !{!136, !123, !128, !130, !132, !134}
!138 = !{!136, !123, !126, !130, !132, !134}
!139 = !{!136, !123, !126, !128, !132, !134}
!140 = !{!136, !123, !126, !128, !130, !134}
!141 = !{!136, !126, !128, !130, !132, !134}
!142 = !{!143}
!143 = distinct !{!143, !144, !"placed.2: %arg.clip.4"}
!144 = distinct !{!144, !"placed.2"}
!145 = !{!146}
!146 = distinct !{!146, !144, !"placed.2: %retptr"}
