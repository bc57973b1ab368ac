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

Lemma sq_ge0 n (x : 'cV[R]_n) : 0 <= sq x.
Proof. by apply: sumr_ge0 => i _; apply: sqr_ge0. Qed.

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
