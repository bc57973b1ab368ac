(* Certificates as tables of rationals: what is computed to check them, and that it implies the statement. *)
From Coq Require Import QArith_base Lia.
From mathcomp Require Import all_ssreflect all_algebra.
From Multirate Require Import Statement Theory.
Set Implicit Arguments. Unset Strict Implicit. Import Order.TTheory GRing.Theory Num.Theory. Local Open Scope ring_scope.

(* Sums of numbers with one denominator keep it. *)
Definition add a b := if Pos.eqb (Qden a) (Qden b) then Qmake (Z.add (Qnum a) (Qnum b)) (Qden a) else Qplus a b.
Definition zero := Qmake 0 1.
Definition unsigned a := if Z.leb 0 (Qnum a) then a else Qopp a.
Definition total n f := foldr (fun i s => add (f i) s) zero (iota 0 n).

Definition get (t : table) i j := nth zero (nth [::] t i) j.
Definition tab m n (f : nat -> nat -> Q) : table := mkseq (fun i => mkseq (f i) n) m.
Definition tmul m k n a b := tab m n (fun i j => total k (fun l => Qmult (get a i l) (get b l j))).
Definition tsub m n a b := tab m n (fun i j => add (get a i j) (Qopp (get b i j))).
Definition tturn m n a := tab m n (fun i j => get a j i).
Definition tscalar n c := tab n n (fun i j => if i == j then c else zero).
Definition trow m n1 n2 a b := tab m (n1 + n2) (fun i j => if (j < n1)%N then get a i j else get b i (j - n1)).
Definition tcol m1 m2 n a b := tab (m1 + m2) n (fun i j => if (i < m1)%N then get a i j else get b (i - m1) j).
Definition tsame m n a b := all (fun i => all (fun j => Qeq_bool (get a i j) (get b i j)) (iota 0 n)) (iota 0 m).
Definition tfro m n a := total m (fun i => total n (fun j => Qmult (get a i j) (get a i j))).
Definition tdominant n a := tsame n n (tturn n n a) a &&
  all (fun i => Qle_bool zero (total n (fun j => if j == i then get a i j else Qopp (unsigned (get a i j))))) (iota 0 n).

Arguments integer : simpl never.
Arguments Z.mul : simpl never.

Section Numbers.
Variable R : archiFieldType.
Local Notation integer := (@integer R).
Local Notation number := (@number R).
Local Notation mat := (mat R).

Lemma integer_nat k : integer (Z.of_nat k) = k%:R.
Proof. by case: k => // k; rewrite /integer /= SuccNat2Pos.id_succ. Qed.

Lemma integerN a : integer (Z.opp a) = - integer a.
Proof. by case: a => [|a|a]; rewrite /integer /= ?oppr0 ?opprK. Qed.

Lemma integer_sub a b : integer (Z.sub (Z.of_nat a) (Z.of_nat b)) = a%:R - b%:R.
Proof.
have le c d : (d <= c)%N -> integer (Z.sub (Z.of_nat c) (Z.of_nat d)) = c%:R - d%:R.
  by move=> dc; rewrite -natrB // -integer_nat -minusE Nat2Z.inj_sub //; apply/ssrnat.leP.
have [/le //|/ltnW /le h] := leqP b a.
by rewrite -[LHS]opprK -integerN -[RHS]opprK opprB -h; congr (- integer _); lia.
Qed.

Lemma as_nat a : exists b c, a = Z.sub (Z.of_nat b) (Z.of_nat c).
Proof. by exists (Z.to_nat a), (Z.to_nat (Z.opp a)); lia. Qed.

Lemma integerD a b : integer (Z.add a b) = integer a + integer b.
Proof.
have [c [d ->]] := as_nat a; have [e [f ->]] := as_nat b.
rewrite (_ : Z.add _ _ = Z.sub (Z.of_nat (c + e)) (Z.of_nat (d + f))) ?integer_sub ?natrD; last by rewrite -!plusE; lia.
by rewrite opprD addrACA.
Qed.

Lemma integerM a b : integer (Z.mul a b) = integer a * integer b.
Proof.
have [c [d ->]] := as_nat a; have [e [f ->]] := as_nat b.
rewrite (_ : Z.mul _ _ = Z.sub (Z.of_nat (c * e + d * f)) (Z.of_nat (c * f + d * e))) ?integer_sub; last by rewrite -!plusE -!multE; lia.
by rewrite !natrD !natrM mulrBl !mulrBr opprB addrACA opprD.
Qed.

Lemma integer_gt0 p : 0 < integer (Zpos p).
Proof. by rewrite /integer ltr0n; apply/ssrnat.ltP; apply: Pos2Nat.is_pos. Qed.

Lemma integer_le a b : Z.leb a b -> integer a <= integer b.
Proof.
move=> /Z.leb_le ab; rewrite -subr_ge0 -integerN -integerD; have [c ->] : exists c, Z.add b (Z.opp a) = Z.of_nat c.
  by exists (Z.to_nat (Z.sub b a)); lia.
by rewrite integer_nat ler0n.
Qed.

Lemma integer_neq0 p : integer (Zpos p) != 0.
Proof. exact: lt0r_neq0 (integer_gt0 p). Qed.
Hint Resolve integer_gt0 integer_neq0 : core.

Lemma number0 : number zero = 0.
Proof. by rewrite /number /integer mul0r. Qed.

Lemma number1 : number (Qmake 1 1) = 1.
Proof. by rewrite /number /integer divr1. Qed.

Lemma numberN a : number (Qopp a) = - number a.
Proof. by rewrite /number /= integerN mulNr. Qed.

Lemma numberM a b : number (Qmult a b) = number a * number b.
Proof. by rewrite /number /= -[Zpos _]/(Z.mul (Zpos _) (Zpos _)) !integerM mulf_div. Qed.

Lemma numberD a b : number (add a b) = number a + number b.
Proof.
rewrite /add; case: ifP => [/Peqb_true_eq same|_].
  by rewrite /number /= integerD mulrDl -same.
by rewrite /number /= -[Zpos (_ * _)]/(Z.mul (Zpos _) (Zpos _)) integerD !integerM addf_div.
Qed.

Lemma number_eq a b : Qeq_bool a b -> number a = number b.
Proof.
move=> /Qeq_bool_iff same; apply/eqP; rewrite eqr_div //; apply/eqP.
by rewrite -!integerM; congr integer; exact: same.
Qed.

Lemma number_le a b : Qle_bool a b -> number a <= number b.
Proof. by move=> /integer_le; rewrite !integerM /number ler_pdivr_mulr // mulrAC ler_pdivl_mulr. Qed.

Lemma number_unsigned a : number (unsigned a) = `|number a|.
Proof.
have ge b : Z.leb 0 (Qnum b) -> number b = `|number b|.
  by move=> /integer_le b0; rewrite ger0_norm // divr_ge0 // ltW.
rewrite /unsigned; case: ifP => [/ge //|neg]; rewrite ge ?numberN ?normrN //=.
by move/Z.leb_gt: neg => neg; apply/Z.leb_le; lia.
Qed.

Lemma number_total n f : number (total n f) = \sum_(i < n) number (f i).
Proof.
rewrite -(big_mkord xpredT (fun i => number (f i))) /index_iota subn0 /total.
by elim: (iota 0 n) => [|i s IH]; rewrite /= ?big_nil ?number0 // big_cons numberD IH.
Qed.

Lemma get_tab m n f i j : (i < m)%N -> (j < n)%N -> get (tab m n f) i j = f i j.
Proof. by move=> im jn; rewrite /get nth_mkseq // nth_mkseq. Qed.

Lemma mat_tab m n f : mat m n (tab m n f) = \matrix_(i, j) number (f i j).
Proof. by apply/matrixP => i j; rewrite !mxE -/(get _ i j) get_tab. Qed.

Lemma mat_mul m k n a b : mat m n (tmul m k n a b) = mat m k a *m mat k n b.
Proof.
rewrite mat_tab; apply/matrixP => i j; rewrite !mxE number_total; apply: eq_bigr => l _.
by rewrite numberM !mxE.
Qed.

Lemma mat_sub m n a b : mat m n (tsub m n a b) = mat m n a - mat m n b.
Proof. by rewrite mat_tab; apply/matrixP => i j; rewrite !mxE numberD numberN. Qed.

Lemma mat_turn m n a : mat m n (tturn m n a) = (mat n m a)^T.
Proof. by rewrite mat_tab; apply/matrixP => i j; rewrite !mxE. Qed.

Lemma mat_scalar n c : mat n n (tscalar n c) = (number c)%:M.
Proof.
rewrite mat_tab; apply/matrixP => i j; rewrite !mxE -val_eqE /=.
by case: eqP => _; rewrite ?mulr1n // mulr0n number0.
Qed.

Lemma mat_zero m n : mat m n [::] = 0.
Proof. by apply/matrixP => i j; rewrite !mxE !nth_nil number0. Qed.

Lemma mat_row m n1 n2 a b : mat m (n1 + n2) (trow m n1 n2 a b) = row_mx (mat m n1 a) (mat m n2 b).
Proof.
rewrite mat_tab; apply/matrixP => i j; rewrite !mxE; case: splitP => l ->; rewrite mxE ?ltn_ord //.
by rewrite addKn.
Qed.

Lemma mat_col m1 m2 n a b : mat (m1 + m2) n (tcol m1 m2 n a b) = col_mx (mat m1 n a) (mat m2 n b).
Proof.
rewrite mat_tab; apply/matrixP => i j; rewrite !mxE; case: splitP => l ->; rewrite mxE ?ltn_ord //.
by rewrite addKn.
Qed.

Lemma mat_up m1 m2 n a : usubmx (mat (m1 + m2) n a) = mat m1 n a.
Proof. by apply/matrixP => i j; rewrite !mxE. Qed.

Lemma mat_down m1 m2 n a : dsubmx (mat (m1 + m2) n a) = mat m2 n (drop m1 a).
Proof. by apply/matrixP => i j; rewrite !mxE nth_drop. Qed.

Lemma mat_same m n a b : tsame m n a b -> mat m n a = mat m n b.
Proof.
move=> /allP same; apply/matrixP => i j; rewrite !mxE; apply: number_eq.
by apply: (allP (same _ _)); rewrite mem_iota add0n ltn_ord.
Qed.

Lemma number_fro m n a : number (tfro m n a) = fro (mat m n a).
Proof.
rewrite number_total; apply: eq_bigr => i _; rewrite number_total; apply: eq_bigr => j _.
by rewrite numberM mxE expr2.
Qed.

Lemma dominant n a : tdominant n a -> (mat n n a)^T = mat n n a /\ forall x, 0 <= form (mat n n a) x.
Proof.
move=> /andP [/mat_same]; rewrite mat_turn => sym /allP dom; split=> //; apply: dominant_form => // i.
have := dom i; rewrite mem_iota add0n ltn_ord => /(_ isT) /number_le; rewrite number0 number_total.
congr (_ <= _); apply: eq_bigr => j _; rewrite -val_eqE /= mxE.
by case: eqP; rewrite ?numberN ?number_unsigned.
Qed.
End Numbers.
