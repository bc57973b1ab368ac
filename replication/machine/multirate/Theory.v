(* From certificates in matrices over R to the statement: storage functions from above, disturbances from below. *)
From Coq Require Import QArith_base.
From mathcomp Require Import all_ssreflect all_algebra.
From Multirate Require Import Statement.
Set Implicit Arguments. Unset Strict Implicit. Import Order.TTheory GRing.Theory Num.Theory. Local Open Scope ring_scope.

Section Forms.
Variable R : archiFieldType.

Definition form n (M : 'M[R]_n) (x : 'cV[R]_n) := (x^T *m M *m x) 0 0.

Lemma sqE n (x : 'cV[R]_n) : sq x = (x^T *m x) 0 0.
Proof. by rewrite mxE; apply: eq_bigr => i _; rewrite mxE expr2. Qed.

Lemma formB n (M M' : 'M[R]_n) x : form (M - M') x = form M x - form M' x.
Proof. by rewrite /form mulmxBr mulmxBl mxE [X in _ + X]mxE. Qed.

Lemma form_scalar n (c : R) (x : 'cV[R]_n) : form c%:M x = c * sq x.
Proof. by rewrite /form mul_mx_scalar -scalemxAl mxE sqE. Qed.

Lemma sq_ge0 n (x : 'cV[R]_n) : 0 <= sq x.
Proof. by apply: sumr_ge0 => i _; apply: sqr_ge0. Qed.

Lemma form_gram m n (F : 'M[R]_(m, n)) (x : 'cV[R]_m) : 0 <= form (F *m F^T) x.
Proof. by rewrite (_ : form _ x = sq (F^T *m x)) ?sq_ge0 // sqE trmx_mul trmxK /form !mulmxA. Qed.

Lemma sq0 n : sq (0 : 'cV[R]_n) = 0.
Proof. by apply: big1 => i _; rewrite mxE expr0n. Qed.

Lemma sqN n (x : 'cV[R]_n) : sq (- x) = sq x.
Proof. by apply: eq_bigr => i _; rewrite mxE sqrrN. Qed.

Lemma sq_gt0 n (x : 'cV[R]_n) : x != 0 -> 0 < sq x.
Proof.
move=> x0; rewrite lt_def sq_ge0 andbT; apply: contraNneq x0 => /psumr_eq0P h; apply/eqP/matrixP => i j.
by have /eqP := h (fun i _ => sqr_ge0 _) i isT; rewrite sqrf_eq0 (ord1 j) mxE => /eqP.
Qed.

Lemma sq_col m n (x : 'cV[R]_m) (y : 'cV[R]_n) : sq (col_mx x y) = sq x + sq y.
Proof. by rewrite !sqE tr_col_mx mul_row_col mxE. Qed.

Lemma sq_both_ways n (a b : 'cV[R]_n) : sq a *+ 2 <= sq (a - b) + sq (- a - b).
Proof.
rewrite -opprD sqN /sq -big_split -sumrMnl; apply: ler_sum => i _ /=; rewrite !mxE sqrrB sqrrD.
by rewrite addrACA (addrACA (a i 0 ^+ 2)) addNr addr0 -mulr2n ler_addl addr_ge0 ?sqr_ge0.
Qed.

(* A symmetric matrix in which each diagonal entry is at least the sum of the others in its row, without signs. *)
Lemma dominant_form n (M : 'M[R]_n) : M^T = M ->
  (forall i, 0 <= \sum_j (if j == i then M i j else - `|M i j|)) -> forall x, 0 <= form M x.
Proof.
move=> sym dom x; pose a i j := if j == i then M i j else - `|M i j|.
have aC i j : a i j = a j i by rewrite /a eq_sym -[in M i j]sym mxE.
suff: 0 <= form M x *+ 2 by rewrite pmulrn_lge0.
have -> : form M x = \sum_i \sum_j M i j * (x i 0 * x j 0).
  rewrite /form mxE; under eq_bigr => j _ do rewrite mxE mulr_suml.
  rewrite exchange_big /=; apply: eq_bigr => i _; apply: eq_bigr => j _.
  by rewrite !mxE [x i 0 * _]mulrC -!mulrA.
apply: (@le_trans _ _ ((\sum_i x i 0 ^+ 2 * \sum_j a i j) *+ 2)).
  by rewrite mulrn_wge0 // sumr_ge0 // => i _; rewrite mulr_ge0 ?sqr_ge0 ?dom.
have -> : (\sum_i x i 0 ^+ 2 * \sum_j a i j) *+ 2 = \sum_i \sum_j a i j * (x i 0 ^+ 2 + x j 0 ^+ 2).
  rewrite mulr2n (eq_bigr (fun i => \sum_j a i j * x i 0 ^+ 2)) => [|i _]; last by rewrite mulrC mulr_suml.
  rewrite {2}exchange_big -big_split; apply: eq_bigr => i _; rewrite -big_split; apply: eq_bigr => j _ /=.
  by rewrite mulrDr [a j i]aC.
rewrite -sumrMnl; apply: ler_sum => i _; rewrite -sumrMnl; apply: ler_sum => j _; rewrite -mulrnAr /a.
have sqr_sum u v : (u * v *+ 2 <= u ^+ 2 + v ^+ 2 :> R) /\ (- (u ^+ 2 + v ^+ 2) <= u * v *+ 2).
  split; first by rewrite -subr_ge0 -addrAC -sqrrB sqr_ge0.
  by rewrite ler_oppl -subr_ge0 opprK addrAC -sqrrD sqr_ge0.
case: (altP (j =P i)) => [->|_]; first by rewrite -mulr2n -expr2.
have [lo up] := sqr_sum (x i 0) (x j 0).
rewrite mulNr ler_oppl -mulrN; apply: le_trans (ler_norm _) _.
by rewrite normrM ler_wpmul2l // ler_norml ler_oppl opprK lo ler_oppl up.
Qed.
End Forms.

Section Errors.
Variables (R : archiFieldType) (n nu m p q z : nat) (G : system R n nu m p q z).
Hypothesis S_twice : forall k, S G k *m S G k = S G k.
Implicit Types (L : nat -> 'M[R]_(n, p)).

(* The error system (16): what a step makes of error and disturbances; and what is measured of them. *)
Definition step L k : 'M_(n, n + (m + q)) := row_mx (A G - L k *m S G k *m C G) (row_mx (Bd G) (- (L k *m S G k *m D G))).
Definition seen k : 'M_(p, n + (m + q)) := row_mx (S G k *m C G) (row_mx 0 (S G k *m D G)).
Fixpoint error r L (e0 : 'M[R]_(n, r)) (v : nat -> 'M[R]_(m + q, r)) k :=
  if k is t.+1 then step L t *m col_mx (error L e0 v t) (v t) else e0.

Lemma stepE L k (e : 'cV_n) d w : step L k *m col_mx e (col_mx d w) =
  (A G - L k *m S G k *m C G) *m e + (Bd G *m d - L k *m S G k *m D G *m w).
Proof. by rewrite !mul_row_col mulNmx. Qed.

Lemma error_is x0 x1 L u d w k :
  state G x0 u d k - observed G L x1 u (output G x0 u d w) k = error L (x0 - x1) (fun t => col_mx (d t) (w t)) k.
Proof.
elim: k => //= k <-; rewrite stepE /output mulmxBr (mulmxA (L k *m S G k)) -(mulmxA (L k) (S G k) (S G k)) S_twice.
move: (observed _ _ _ _ _ _) (state _ _ _ _ _) => xh x; rewrite mulmxDr !mulmxA.
have -> : A G *m x = (A G - L k *m S G k *m C G) *m x + L k *m S G k *m C G *m x by rewrite -mulmxDl subrK.
move: (_ *m xh) ((_ - _) *m x) (L k *m S G k *m C G *m x) (_ *m w k) (_ *m u k) (_ *m d k) => b a c e f h.
have -> : a + c + f + h = a + h + (c + f) by rewrite -(addrA a) addrAC.
by rewrite [b + f]addrC [_ + (c + e)]addrACA [f + c]addrC addrKA opprD addrACA.
Qed.

Lemma observer_predicts L : uses the_past (observer G L).
Proof.
move=> k u u' y y' same; congr (_ *m _); elim: k same => //= k IH same; have [-> ->] := same k (ltnSn k).
by rewrite IH // => t past; apply: same; apply: ltnW.
Qed.

(* From above: matrices P_k and gains L_k for which the matrix (30) with Y_k = P_k L_k has room. *)
Section Above.
Variables (P : nat -> 'M[R]_n) (L : nat -> 'M[R]_(n, p)) (g room c : R).
Hypotheses (N_gt0 : (0 < N G)%N) (P_turns : periodic G P) (L_turns : periodic G L) (S_turns : periodic G (S G)).
Hypotheses (room_gt0 : 0 < room) (c_ge0 : 0 <= c) (P_sym : forall k, (P k)^T = P k) (P_small : forall k x, form (P k) x <= c * sq x).
Hypothesis above : forall k x, room * sq x <= form (Theta_hat G P (fun k => P k *m L k) g k) x.

Lemma factored k : row_mx (P k *m A G - P k *m L k *m S G k *m C G)
  (row_mx (P k *m Bd G) (- (P k *m L k *m S G k *m D G))) = P k *m step L k.
Proof. by rewrite !mul_mx_row mulmxBr mulmxN !mulmxA. Qed.

Lemma ThetaE k : Theta G P L g k = rest G P g k - (step L k)^T *m P k *m step L k.
Proof. by []. Qed.

Lemma form_Theta k (x : 'cV[R]_(n + (m + q))) : room * sq x <= form (Theta G P L g k) x.
Proof.
have := above k (col_mx (- (step L k *m x)) x).
suff -> : form (Theta_hat G P (fun k => P k *m L k) g k) (col_mx (- (step L k *m x)) x) = form (Theta G P L g k) x.
  by apply: le_trans; rewrite sq_col ler_pmul2l // ler_addr sq_ge0.
rewrite /form /Theta_hat factored tr_col_mx mul_row_block mul_row_col [(- _)^T]linearN /= !trmx_mul P_sym !mulNmx !mulmxA addNr.
by rewrite mul0mx add0r ThetaE mulmxBr mulmxBl mulmxDl !mulNmx !mulmxA [in LHS]addrC.
Qed.

Lemma form_P k (x : 'cV[R]_n) : room * sq x <= form (P k) x.
Proof.
have := above k (col_mx x 0); rewrite sq_col sq0 addr0.
by rewrite /form /Theta_hat tr_col_mx mul_row_block mul_row_col mulmx0 addr0 trmx0 mul0mx addr0.
Qed.

Lemma rest_sym k : (rest G P g k)^T = rest G P g k.
Proof. by rewrite tr_block_mx !linear0 linearB /= P_sym tr_scalar_mx trmx_mul trmxK. Qed.

Lemma with_room j (M : 'M[R]_j) : M^T = M -> (forall x, room * sq x <= form M x) -> posdef M.
Proof. by move=> sym pos; split=> // x x0; apply: lt_le_trans (pos x); rewrite mulr_gt0 ?sq_gt0. Qed.

Lemma keeps_theorem1 : theorem1 G L g.
Proof.
exists P => // k; split; first exact: with_room (form_P k).
by apply: with_room (form_Theta k); rewrite ThetaE linearB /= rest_sym !trmx_mul trmxK P_sym mulmxA.
Qed.

Lemma keeps_theorem2 : theorem2 G g.
Proof.
exists P, (fun k => P k *m L k); split=> // [k|k]; first by rewrite P_turns L_turns.
split; first exact: with_room (form_P k).
by apply: with_room (above k); rewrite tr_block_mx rest_sym P_sym trmxK.
Qed.

(* The storage before the step at k. *)
Let V k e := form (P (k + (N G).-1)) e.

Lemma falls k e (x : 'cV[R]_(m + q)) :
  V k.+1 (step L k *m col_mx e x) + sq (W G *m e) + room * sq e <= V k e + g ^+ 2 * sq x.
Proof.
have Pk : P (k.+1 + (N G).-1) = P k by rewrite addSnnS prednK // P_turns.
have : room * sq e <= form (Theta G P L g k) (col_mx e x).
  by apply: le_trans (form_Theta k (col_mx e x)); rewrite ler_pmul2l // sq_col ler_addl sq_ge0.
have -> : form (Theta G P L g k) (col_mx e x) =
    V k e - sq (W G *m e) + g ^+ 2 * sq x - V k.+1 (step L k *m col_mx e x).
  rewrite ThetaE /V Pk /form mulmxBr mulmxBl mxE [X in _ + X]mxE; congr (_ - _); last by rewrite trmx_mul !mulmxA.
  rewrite tr_col_mx mul_row_block !mulmx0 addr0 add0r mul_row_col mulmxBr mulmxBl mxE; congr (_ + _).
    by rewrite mxE [X in _ + X]mxE sqE trmx_mul !mulmxA.
  by rewrite mul_mx_scalar -scalemxAl mxE sqE.
by rewrite ler_subr_addr [_ - _ + _]addrAC ler_subr_addr; apply: le_trans; rewrite addrC addrA.
Qed.

Lemma V_ge0 k e : 0 <= V k e.
Proof. by apply: le_trans (form_P _ e); rewrite mulr_ge0 ?sq_ge0 ?(ltW room_gt0). Qed.

Lemma energy (v : nat -> 'cV[R]_(m + q)) T : V T (error L 0 v T) + \sum_(k < T) sq (W G *m error L 0 v k) <= g ^+ 2 * \sum_(k < T) sq (v k).
Proof.
elim: T => [|T IH]; first by rewrite !big_ord0 mulr0 addr0 /V /form mulmx0 mxE.
rewrite !big_ord_recr /= mulrDr [_ + sq _]addrC addrA.
have h := falls T (error L 0 v T) (v T).
apply: le_trans (_ : V T (error L 0 v T) + g ^+ 2 * sq (v T) + \sum_(k < T) sq (W G *m error L 0 v k) <= _).
  by rewrite ler_add2r; apply: le_trans h; rewrite ler_addl mulr_ge0 ?sq_ge0 ?(ltW room_gt0).
by rewrite addrAC ler_add2r.
Qed.

Lemma keeps_above : keeps G (observer G L) g.
Proof.
move=> u d w T; under eq_bigr => k _ do rewrite -mulmxBr error_is subrr.
under [X in _ <= _ * X]eq_bigr => k _ do rewrite -sq_col.
by apply: le_trans (energy (fun t => col_mx (d t) (w t)) T); rewrite ler_addr V_ge0.
Qed.

Lemma stable_above : stable G L.
Proof.
have C_gt0 : 0 < c + room by rewrite ltr_paddl.
pose r := 1 - room / (c + room); exists ((c + room) / room), r.
have r_ge0 : 0 <= r by rewrite subr_ge0 ler_pdivr_mulr // mul1r ler_addr.
split=> // [|x0 x1 u k /=]; first by rewrite ltr_subl_addr ltr_addl divr_gt0.
rewrite error_is; set e := error _ _ _; set e0 := x0 - x1.
have V_le j x : V j x <= (c + room) * sq x.
  by apply: le_trans (P_small _ x) _; rewrite mulrDl ler_addl mulr_ge0 ?sq_ge0 ?(ltW room_gt0).
have fall j : V j.+1 (e j.+1) <= r * V j (e j).
  have := falls j (e j) 0; rewrite sq0 mulr0 addr0.
  rewrite (_ : _ *m _ = e j.+1); last by rewrite -[X in col_mx _ X]col_mx0.
  rewrite mulrBl mul1r ler_subr_addr; apply: le_trans; rewrite -[_ + sq _ + _]addrA ler_add2l.
  apply: le_trans (_ : room * sq (e j) <= _); last by rewrite ler_addr sq_ge0.
  by rewrite -mulrA ler_pmul2l // mulrC ler_pdivr_mulr // mulrC V_le.
have V_k : V k (e k) <= r ^+ k * V 0 e0.
  elim: k => [|k IH]; first by rewrite expr0 mul1r.
  by apply: le_trans (fall k) _; rewrite exprS -mulrA ler_wpmul2l.
rewrite -(ler_pmul2l room_gt0); apply: le_trans (form_P (k + (N G).-1) (e k)) _; apply: le_trans V_k _.
rewrite -!mulrA mulrCA mulVKf ?gt_eqF // mulrCA.
by rewrite ler_wpmul2l ?exprn_ge0.
Qed.
End Above.

(* From below: what every disturbance says of g if it is hidden from the instants that count. *)
Definition fro a b (X : 'M[R]_(a, b)) := \sum_i \sum_j X i j ^+ 2.
Definition bounded (sees : rel nat) L g := forall (v : nat -> 'cV[R]_(m + q)) T,
  (forall k t, (k < T)%N -> sees t k -> seen t *m col_mx (error L 0 v t) (v t) = 0) ->
  \sum_(k < T) sq (W G *m error L 0 v k) <= g ^+ 2 * \sum_(k < T) sq (v k).

Lemma fro_col a b (X : 'M[R]_(a, b)) : fro X = \sum_j sq (col j X).
Proof. by rewrite /fro exchange_big; apply: eq_bigr => j _; apply: eq_bigr => i _; rewrite mxE. Qed.

Lemma fro_trace a b (X : 'M[R]_(a, b)) : fro X = \tr (X *m X^T).
Proof. by apply: eq_bigr => i _; rewrite mxE; apply: eq_bigr => j _; rewrite mxE expr2. Qed.

Lemma eq_error r L (e0 : 'M[R]_(n, r)) (v v' : nat -> 'M[R]_(m + q, r)) k : (forall t, v t = v' t) -> error L e0 v k = error L e0 v' k.
Proof. by move=> same; elim: k => //= k ->; rewrite same. Qed.

Lemma col_error r L (e0 : 'M[R]_(n, r)) (v : nat -> 'M[R]_(m + q, r)) j k : col j (error L e0 v k) = error L (col j e0) (fun t => col j (v t)) k.
Proof. by elim: k => //= k <-; rewrite !colE -mulmxA mul_col_mx. Qed.

Lemma keeps_bounded L g : keeps G (observer G L) g -> bounded (fun _ _ => false) L g.
Proof.
move=> kept v T _; have := kept (fun=> 0) (fun t => usubmx (v t)) (fun t => dsubmx (v t)) T.
have same t : col_mx (usubmx (v t)) (dsubmx (v t)) = v t by rewrite vsubmxK.
under eq_bigr => k _ do rewrite -mulmxBr error_is subrr (eq_error _ _ _ same).
by under [X in _ <= _ * X]eq_bigr => k _ do rewrite -sq_col same.
Qed.

Lemma state_is L d w k : (forall t, L t = 0) ->
  state G 0 (fun=> 0) d k = error L 0 (fun t => col_mx (d t) (w t)) k.
Proof. by move=> none; elim: k => //= k ->; rewrite stepE none !mul0mx mulmx0 !subr0 addr0. Qed.

Lemma stateN d k : state G 0 (fun=> 0) (fun t => - d t) k = - state G 0 (fun=> 0) d k.
Proof. by elim: k => [|k /= ->]; rewrite /= ?oppr0 // mulmx0 !addr0 !mulmxN opprD. Qed.

Lemma any_bounded sees E L g : (forall t, L t = 0) -> uses sees E -> keeps G E g -> bounded sees L g.
Proof.
move=> none sight kept v T hidden; pose d t := usubmx (v t); pose w t := dsubmx (v t).
have same t : col_mx (d t) (w t) = v t by rewrite vsubmxK.
have zero k t : (k < T)%N -> sees t k -> output G 0 (fun=> 0) d w t = 0.
  move=> kT /(hidden _ _ kT) <-; rewrite /output (state_is d w _ none) (eq_error _ _ _ same) -[in RHS](same t).
  by rewrite !mul_row_col mul0mx add0r mulmxDr !mulmxA.
have flip t : output G 0 (fun=> 0) (fun t => - d t) (fun t => - w t) t = - output G 0 (fun=> 0) d w t.
  by rewrite /output stateN !mulmxN -opprD mulmxN.
rewrite -(ler_pmuln2r (ltn0Sn 1)) mulr2n [X in _ <= X]mulr2n.
have := ler_add (kept (fun=> 0) d w T) (kept (fun=> 0) (fun t => - d t) (fun t => - w t) T).
under [X in _ + _ * X]eq_bigr => k _ do rewrite !sqN -sq_col same.
under [X in _ * X + _]eq_bigr => k _ do rewrite -sq_col same.
apply: le_trans; rewrite -!big_split; apply: ler_sum => k _ /=.
rewrite stateN (state_is d w _ none) (eq_error _ _ _ same) -mulr2n mulmxN.
rewrite (sight k _ (fun=> 0) _ (fun=> 0)) => [|t st]; last by rewrite (zero _ _ (ltn_ord k)).
rewrite [E _ (output _ _ _ _ _) k](sight k _ (fun=> 0) _ (fun=> 0)) ?sq_both_ways // => t st.
by rewrite flip (zero _ _ (ltn_ord k)) // oppr0.
Qed.

(* A disturbance with r columns, as error and disturbance Z_t at the live instants, which come before all others. *)
Section Trajectory.
Variables (sees : rel nat) (L : nat -> 'M[R]_(n, p)) (g : R) (r : nat) (Z : nat -> 'M[R]_(n + (m + q), r)) (live : pred nat).
Hypotheses (bound : bounded sees L g) (start : usubmx (Z 0%N) = 0).
Hypothesis goes_on : forall t, live t.+1 -> live t /\ usubmx (Z t.+1) = step L t *m Z t.

Lemma follows t : live t -> error L 0 (fun t => dsubmx (Z t)) t = usubmx (Z t).
Proof. by elim: t => [_|t IH /goes_on [/IH /= -> ->]]; rewrite ?start // vsubmxK. Qed.

Lemma below T : (forall t, (t < T)%N -> live t) ->
  (forall k t, (k < T)%N -> sees t k -> live t /\ seen t *m Z t = 0) ->
  \sum_(k < T) fro (W G *m usubmx (Z k)) <= g ^+ 2 * \sum_(k < T) fro (dsubmx (Z k)).
Proof.
move=> alive hidden; under eq_bigr => k _ do rewrite fro_col; under [X in _ <= _ * X]eq_bigr => k _ do rewrite fro_col.
rewrite exchange_big [X in _ * X]exchange_big mulr_sumr; apply: ler_sum => j _ /=.
have col_X t : live t -> error L 0 (fun t => col j (dsubmx (Z t))) t = col j (usubmx (Z t)).
  by move=> /follows <-; rewrite col_error !colE mul0mx.
rewrite (eq_bigr (fun k : 'I_T => sq (W G *m error L 0 (fun t => col j (dsubmx (Z t))) k))) => [|k _]; last first.
  by rewrite col_X ?alive // !colE mulmxA.
apply: bound => k t kT st; have [lt zt] := hidden k t kT st.
by rewrite col_X // !colE -mul_col_mx vsubmxK mulmxA zt mul0mx.
Qed.
End Trajectory.

Lemma at_least (lo g o v : R) : 0 <= g -> 0 < v -> lo ^+ 2 * v <= o -> o <= g ^+ 2 * v -> lo <= g.
Proof.
move=> g0 v0 ov gv; case: lerP => // g_lo; have := le_trans ov gv; rewrite ler_pmul2r // leNgt.
by rewrite -subr_gt0 subr_sqr mulr_gt0 ?subr_gt0 // ltr_paddr // (le_lt_trans g0).
Qed.

Lemma at_least_in_time (lo g o v c : R) : 0 <= g -> 0 <= c -> 0 < v -> lo ^+ 2 * v <= o ->
  (forall T, o *+ T <= g ^+ 2 * (c + v *+ T)) -> lo <= g.
Proof.
move=> g0 c0 v0 ov long; apply: at_least ov _ => //; case: lerP => // less; pose e := o - g ^+ 2 * v.
have e0 : 0 < e by rewrite subr_gt0.
have := long (Num.bound (g ^+ 2 * c / e)); rewrite mulrDr mulrnAr -ler_subl_addr -mulrnBl leNgt -/e => /negP; case.
by rewrite -mulr_natl -ltr_pdivr_mulr // archi_boundP // divr_ge0 ?mulr_ge0 ?exprn_ge0 // ltW.
Qed.

(* A way from rest to a cycle of one period, after which error and disturbance are those before it, turned. *)
Section Cycle.
Variables (watched : bool) (L : nat -> 'M[R]_(n, p)) (g : R) (r pre : nat) (turn : 'M[R]_r).
Variables (way cycle : nat -> 'M[R]_(n + (m + q), r)).
Hypotheses (bound : bounded (fun _ _ => watched) L g) (N_gt0 : (0 < N G)%N).
Hypotheses (L_turns : periodic G L) (S_turns : periodic G (S G)) (turn_orthogonal : turn *m turn^T = 1%:M).
Hypotheses (pre_gt0 : (0 < pre)%N) (whole : (N G %| pre)%N) (start : usubmx (way 0%N) = 0).
Hypothesis on_way : forall t, (t.+1 < pre)%N -> usubmx (way t.+1) = step L t *m way t.
Hypothesis arrives : usubmx (cycle 0%N) = step L pre.-1 *m way pre.-1.
Hypothesis on_cycle : forall t, (t.+1 < N G)%N -> usubmx (cycle t.+1) = step L t *m cycle t.
Hypothesis turns : usubmx (cycle 0%N) *m turn = step L (N G).-1 *m cycle (N G).-1.
Hypothesis hidden_way : watched -> forall t, (t < pre)%N -> seen t *m way t = 0.
Hypothesis hidden_cycle : watched -> forall t, (t < N G)%N -> seen t *m cycle t = 0.

Let turned j a (X : 'M[R]_(a, r)) := iter j (fun X => X *m turn) X.
Definition lasso t := if (t < pre)%N then way t else turned ((t - pre) %/ N G) (cycle ((t - pre) %% N G)).

Lemma turnedM j a b (X : 'M[R]_(a, b)) Y : turned j (X *m Y) = X *m turned j Y.
Proof. by elim: j => //= j ->; rewrite mulmxA. Qed.

Lemma turned_up j (Y : 'M[R]_(n + (m + q), r)) : usubmx (turned j Y) = turned j (usubmx Y).
Proof. by elim: j => //= j <-; rewrite -{1}[turned j Y]vsubmxK mul_col_mx col_mxKu. Qed.

Lemma turned_down j (Y : 'M[R]_(n + (m + q), r)) : dsubmx (turned j Y) = turned j (dsubmx Y).
Proof. by elim: j => //= j <-; rewrite -{1}[turned j Y]vsubmxK mul_col_mx col_mxKd. Qed.

Lemma fro_turned j a (X : 'M[R]_(a, r)) : fro (turned j X) = fro X.
Proof. by elim: j => //= j <-; rewrite !fro_trace trmx_mul mulmxA -(mulmxA _ turn) turn_orthogonal mulmx1. Qed.

Lemma lasso_late j k : (k < N G)%N -> lasso (pre + j * N G + k) = turned j (cycle k).
Proof.
move=> kN; rewrite /lasso -[(_ + k)%N]addnA ltnNge leq_addr addKn /=.
by rewrite divnMDl ?(leq_ltn_trans _ kN) // divn_small // addn0 modnMDl modn_small.
Qed.

Lemma periodic_in T (f : nat -> T) j : periodic G f -> forall k, f (j * N G + k)%N = f k.
Proof. by move=> turns_f; elim: j => // j IH k; rewrite mulSn -addnA addnC turns_f IH. Qed.

Lemma step_late j k : step L (pre + j * N G + k) = step L k /\ seen (pre + j * N G + k) = seen k.
Proof.
have [i ->] := dvdnP whole; rewrite -mulnDl.
by rewrite /step /seen !(periodic_in _ L_turns) !(periodic_in _ S_turns).
Qed.

Lemma late t : (t < pre)%N = false -> exists j k, (k < N G)%N /\ t = (pre + j * N G + k)%N.
Proof.
move=> early; exists ((t - pre) %/ N G)%N, ((t - pre) %% N G)%N; rewrite ltn_mod N_gt0 -addnA -divn_eq subnKC //.
by rewrite leqNgt early.
Qed.

Lemma lasso_goes_on t : usubmx (lasso t.+1) = step L t *m lasso t.
Proof.
have [early|] := boolP (t < pre)%N.
  have [more|] := boolP (t.+1 < pre)%N; first by rewrite /lasso early more on_way.
  rewrite -leqNgt => last; have t_pre : t.+1 = pre by apply/eqP; rewrite eqn_leq early last.
  have := lasso_late 0 N_gt0; rewrite mul0n !addn0 -{1}t_pre => -> /=.
  by rewrite /lasso early arrives -t_pre.
move=> /negbTE /late [j [k [kN ->]]]; rewrite (lasso_late _ kN) (step_late _ _).1 -turnedM -addnS.
have [more|] := boolP (k.+1 < N G)%N; first by rewrite lasso_late // turned_up on_cycle.
rewrite -leqNgt => last; have k_N : k.+1 = N G by apply/eqP; rewrite eqn_leq kN last.
have -> : (pre + j * N G + k.+1 = pre + j.+1 * N G + 0)%N by rewrite k_N addn0 mulSnr addnA.
by rewrite (lasso_late j.+1 N_gt0) turned_up /turned iterSr turns -k_N.
Qed.

Lemma lasso_hidden t : watched -> seen t *m lasso t = 0.
Proof.
move=> w; have [early|/negbTE /late [j [k [kN ->]]]] := boolP (t < pre)%N; first by rewrite /lasso early hidden_way.
by rewrite (lasso_late _ kN) (step_late _ _).2 -turnedM hidden_cycle // /turned; elim: j => //= j ->; rewrite mul0mx.
Qed.

Lemma sum_lasso (f : nat -> R) f' T : (forall j k, (k < N G)%N -> f (pre + j * N G + k)%N = f' k) ->
  \sum_(t < pre + T * N G) f t = \sum_(t < pre) f t + (\sum_(k < N G) f' k) *+ T.
Proof.
move=> same; elim: T => [|T IH]; first by rewrite mul0n addn0 mulr0n addr0.
rewrite mulSnr addnA big_split_ord /= IH mulrSr addrA; congr (_ + _).
by apply: eq_bigr => k _; rewrite same.
Qed.

Lemma below_cycle lo : let v := \sum_(k < N G) fro (dsubmx (cycle k)) in 0 <= g -> 0 < v ->
  lo ^+ 2 * v <= \sum_(k < N G) fro (W G *m usubmx (cycle k)) -> lo <= g.
Proof.
move=> v g0 v0 ov; apply: (at_least_in_time g0 _ v0 ov (c := \sum_(t < pre) fro (dsubmx (way t)))).
  by apply: sumr_ge0 => t _; do 2!apply: sumr_ge0 => ? _; rewrite sqr_ge0.
move=> T; have start' : usubmx (lasso 0) = 0 by rewrite /lasso pre_gt0.
have := below (live := predT) bound start' (fun t _ => conj isT (lasso_goes_on t)) (T := pre + T * N G) (fun _ _ => isT)
  (fun k t _ w => conj isT (lasso_hidden t w)).
rewrite (sum_lasso (f := fun t => fro (W G *m usubmx (lasso t))) (f' := fun k => fro (W G *m usubmx (cycle k)))) => [|j k kN]; last first.
  by rewrite lasso_late // turned_up -turnedM fro_turned.
rewrite (sum_lasso (f := fun t => fro (dsubmx (lasso t))) (f' := fun k => fro (dsubmx (cycle k)))) => [|j k kN]; last first.
  by rewrite lasso_late // turned_down fro_turned.
have -> : \sum_(t < pre) fro (dsubmx (lasso t)) = \sum_(t < pre) fro (dsubmx (way t)).
  by apply: eq_bigr => t _; rewrite /lasso ltn_ord.
apply: le_trans; rewrite ler_addr; apply: sumr_ge0 => t _; do 2!apply: sumr_ge0 => ? _; exact: sqr_ge0.
Qed.
End Cycle.
End Errors.
