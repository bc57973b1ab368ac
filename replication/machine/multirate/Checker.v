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
(* A table as it is, or with one denominator where that is possible; and integers over one denominator. *)
Definition level m n den t := tab m n (fun i j => let a := get t i j in
  let b := Qmake (Z.div (Z.mul (Qnum a) (Zpos den)) (Zpos (Qden a))) den in if Qeq_bool b a then b else a).
Definition over den (t : seq (seq Z)) : table := map (map (fun a => Qmake a den)) t.
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

Lemma number_gt0 a : ~~ Qle_bool a zero -> 0 < number a.
Proof.
move=> /negbTE /Z.leb_gt /= a0; have [k ak] : exists k, Qnum a = Zpos k by exists (Z.to_pos (Qnum a)); lia.
by rewrite /number ak divr_gt0.
Qed.

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

Lemma mat_level m n den a : mat m n (level m n den a) = mat m n a.
Proof.
rewrite mat_tab; apply/matrixP => i j; rewrite !mxE /=.
by case: ifP => // same; apply: number_eq.
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

Section Plants.
Variables (G : plant) (s : schedule).
Local Notation n := (size (tA G)).
Local Notation m := (wide (tBd G)).
Local Notation p := (size (tC G)).
Local Notation q := (wide (tD G)).
Local Notation z := (size (tW G)).
Local Notation all_of := (n + (m + q))%N.
Implicit Types (P L F : table) (Ps Ls Fs : seq table) (N : nat).

Definition sensing k := tab p p (fun i j => if (i == j) && measured s k i then Qmake 1 1 else zero).
Variable den : positive.
Definition tstep L k := let LS := tmul n p p L (sensing k) in
  level n all_of den (trow n n (m + q) (tsub n n (tA G) (tmul n p n LS (tC G)))
    (trow n m q (tBd G) (tsub n q [::] (tmul n p q LS (tD G))))).
Definition tseen k := level p all_of den
  (trow p n (m + q) (tmul p p n (sensing k) (tC G)) (trow p m q [::] (tmul p p q (sensing k) (tD G)))).

(* The matrix (30) of Theorem 2 with P at k, Q before it and the step at k, less F F' and `room`, is dominant. *)
Definition theta P Q step g :=
  let M := tmul n n all_of P step in
  tcol n all_of (n + all_of) (trow n n all_of P M)
    (trow all_of n all_of (tturn all_of n M)
      (tcol n (m + q) all_of (trow n n (m + q) (tsub n n Q (tmul n z n (tturn n z (tW G)) (tW G))) [::])
        (trow (m + q) n (m + q) [::] (tscalar (m + q) (Qmult g g))))).
Definition roomy P Q step F g room := let size := (n + all_of)%N in
  tdominant size (tsub size size (tsub size size (theta P Q step g) (tmul size size size F (tturn size size F))) (tscalar size room)).
Definition check_above Ls Ps Fs g room c := let N := period s in let at_ ts k := nth [::] ts (k %% N) in
  [&& [&& (0 < N)%N, size Ps == N & size Ls == N], ~~ Qle_bool room zero, Qle_bool zero c &
    all (fun k => [&& tsame n n (tturn n n (at_ Ps k)) (at_ Ps k), tdominant n (tsub n n (tscalar n c) (at_ Ps k))
      & roomy (at_ Ps k) (at_ Ps (k + N.-1)%N) (tstep (at_ Ls k) k) (at_ Fs k) g room]) (iota 0 N)].

(* Z_t is error above disturbance: the step at k leads from one to the next; no sensor shows what is hidden at k. *)
Definition leads r step Z Z' := tsame n r (tmul n all_of r step Z) Z'.
Definition hidden r k Z := tsame p r (tmul p all_of r (tseen k) Z) [::].
Definition wins lo r (Zs : seq table) :=
  let sum f := total (size Zs) (fun k => f (nth [::] Zs k)) in let v := sum (fun Z => tfro (m + q) r (drop n Z)) in
  ~~ Qle_bool v zero && Qle_bool (Qmult (Qmult lo lo) v) (sum (fun Z => tfro z r (tmul z n r (tW G) Z))).
Definition check_cycle watched Ls r turn way cycle lo := let N := period s in let pre := size way in
  let steps := mkseq (fun k => tstep (nth [::] Ls k) k) N in let at_ (ts : seq table) k := nth [::] ts k in
  [&& [&& (0 < N)%N, size Ls == N & size cycle == N], [&& (0 < pre)%N, (pre %% N)%N == 0%N & tsame n r (at_ way 0%N) [::]],
    [&& tsame r r (tmul r r r turn (tturn r r turn)) (tscalar r (Qmake 1 1)),
      all (fun t => leads r (at_ steps (t %% N)%N) (at_ way t) (at_ way t.+1)) (iota 0 pre.-1),
      leads r (at_ steps (pre.-1 %% N)%N) (at_ way pre.-1) (at_ cycle 0%N),
      all (fun t => leads r (at_ steps t) (at_ cycle t) (at_ cycle t.+1)) (iota 0 N.-1) &
      leads r (at_ steps N.-1) (at_ cycle N.-1) (tmul n r r (at_ cycle 0%N) turn)],
    watched ==> all (fun t => hidden r t (at_ way t)) (iota 0 pre) && all (fun t => hidden r t (at_ cycle t)) (iota 0 N) &
    wins lo r cycle].
Definition check_finite r way lo := let N := period s in let T := size way in
  let steps := mkseq (tstep [::]) N in let at_ (ts : seq table) k := nth [::] ts k in
  [&& (0 < N)%N, (0 < T)%N && tsame n r (at_ way 0%N) [::],
    all (fun t => leads r (at_ steps (t %% N)%N) (at_ way t) (at_ way t.+1) && hidden r t (at_ way t)) (iota 0 T.-1) &
    wins lo r way].

Definition check_width lo up relative := Qle_bool lo up && Qle_bool up (Qmult lo (add (Qmake 1 1) relative)).

Section Sound.
Variable R : archiFieldType.
Local Notation number := (@number R).
Local Notation mat := (mat R).
Local Notation sys := (under R G s).

Lemma measured_mod k i : measured s k i = measured s (k %% period s) i.
Proof.
apply: eq_in_has => e e_in; congr (_ && _); rewrite modn_dvdm //.
by elim: (s) e_in => //= e' s' IH; rewrite inE => /predU1P [->|/IH h]; rewrite ?dvdn_lcml ?(dvdn_trans h) ?dvdn_lcmr.
Qed.

Lemma S_mod k : S sys k = S sys (k %% period s).
Proof. by congr diag_mx; apply/rowP => i; rewrite !mxE measured_mod. Qed.

Lemma S_turns : periodic sys (S sys).
Proof. by move=> k; rewrite S_mod modnDr -S_mod. Qed.

Lemma S_twice k : S sys k *m S sys k = S sys k.
Proof. by rewrite mulmx_diag; congr diag_mx; apply/rowP => i; rewrite !mxE -natrM mulnb andbb. Qed.

Lemma mat_sensing k : mat p p (sensing k) = S sys k.
Proof.
rewrite mat_tab; apply/matrixP => i j; rewrite !mxE -val_eqE /=.
by case: eqP => _; [case: measured; rewrite ?number1 ?number0 | rewrite number0].
Qed.

Lemma mat_step L k : mat n all_of (tstep L k) = step sys (fun=> mat n p L) k.
Proof. by rewrite mat_level !mat_row !mat_sub !mat_mul mat_sensing mat_zero sub0r. Qed.

Lemma mat_seen k : mat p all_of (tseen k) = seen sys k.
Proof. by rewrite mat_level !mat_row !mat_mul mat_sensing mat_zero. Qed.

Lemma mat_theta P Q L g k : let M := mat n n P *m step sys (fun=> mat n p L) k in
  mat (n + all_of) (n + all_of) (theta P Q (tstep L k) g) =
  block_mx (mat n n P) M M^T (block_mx (mat n n Q - (W sys)^T *m W sys) 0 0 (number g ^+ 2)%:M).
Proof.
move=> M; rewrite /theta mat_col !mat_row mat_col !mat_row.
rewrite mat_turn mat_mul mat_sub mat_mul mat_turn mat_step !mat_zero mat_scalar.
by rewrite numberM -expr2.
Qed.

Lemma cyclic_turns a b (ts : seq table) : size ts = period s -> periodic sys (cyclic R a b ts).
Proof. by move=> N_ts k; rewrite /cyclic N_ts modnDr. Qed.

Section Above.
Variables (Ls Ps Fs : seq table) (g room c : Q).
Hypothesis checked : check_above Ls Ps Fs g room c.
Let P := cyclic R n n Ps.
Let L := cyclic R n p Ls.

Lemma above_sound : let G' := sys in
  [/\ periodic G' L, stable G' L, theorem1 G' L (number g), theorem2 G' (number g) & keeps G' (observer G' L) (number g)].
Proof.
have /and4P [/and3P [N0 /eqP sP /eqP sL] /(@number_gt0 R) room0 /(@number_le R) c0 /allP each] := checked.
rewrite number0 in c0; have Pt := cyclic_turns n n sP; have Lt := cyclic_turns n p sL.
have at_k k : (k %% period s)%N \in iota 0 (period s) by rewrite mem_iota ltn_mod.
have P_sym k : (P k)^T = P k.
  by have /and3P [/(mat_same R)] := each _ (at_k k); rewrite mat_turn modn_mod /P /cyclic sP.
have P_small k x : form (P k) x <= number c * sq x.
  have /and3P [_ /(dominant R) [_ /(_ x)]] := each _ (at_k k); rewrite mat_sub mat_scalar modn_mod formB form_scalar subr_ge0 => small _.
  by rewrite /P /cyclic sP.
have above k x : number room * sq x <= form (Theta_hat sys P (fun k => P k *m L k) (number g) k) x.
  have /and3P [_ _ /(dominant R) [_ /(_ x)]] := each _ (at_k k).
  rewrite !mat_sub mat_scalar mat_mul mat_turn !formB form_scalar subr_ge0 => /le_trans; apply.
  suff -> : Theta_hat sys P (fun k => P k *m L k) (number g) k = mat (n + all_of) (n + all_of) (theta (nth [::] Ps (k %% period s)%N)
      (nth [::] Ps ((k %% period s + (period s).-1) %% period s)%N) (tstep (nth [::] Ls (k %% period s)%N) (k %% period s)) g).
    by rewrite !modn_mod ler_subl_addr ler_addl form_gram.
  have -> : Theta_hat sys P (fun k => P k *m L k) (number g) k =
      block_mx (P k) (P k *m step sys L k) (P k *m step sys L k)^T (rest sys P (number g) k) by rewrite -factored.
  have -> : step sys L k = step sys (fun=> mat n p (nth [::] Ls (k %% period s)%N)) (k %% period s)%N.
    by rewrite /step S_mod /L /cyclic sL.
  by rewrite mat_theta /rest /P /cyclic sP modnDml.
have S2 := S_twice; split=> //.
- by apply: (stable_above (G := sys) S2 N0 Pt room0 c0 P_sym P_small above).
- by apply: (keeps_theorem1 (G := sys) Pt room0 P_sym above).
- by apply: (keeps_theorem2 (G := sys) Pt Lt room0 P_sym above).
- by apply: (keeps_above (G := sys) S2 N0 Pt room0 P_sym above).
Qed.
End Above.

Lemma step_mod (L : nat -> 'M[R]_(n, p)) k : (forall k, L k = L (k %% period s)%N) -> step sys L k = step sys L (k %% period s)%N.
Proof. by move=> turns; rewrite /step S_mod turns. Qed.

Lemma leads_sound r L k Z Z' : leads r (tstep L k) Z Z' -> mat n r Z' = step sys (fun=> mat n p L) k *m mat all_of r Z.
Proof. by move=> /(mat_same R) <-; rewrite mat_mul mat_step. Qed.

Lemma hidden_sound r k Z : hidden r k Z -> seen sys k *m mat all_of r Z = 0.
Proof. by move=> /(mat_same R); rewrite mat_mul mat_seen mat_zero. Qed.

Lemma wins_sound lo r Zs : wins lo r Zs -> let Z k := mat all_of r (nth [::] Zs k) in
  (0 < \sum_(k < size Zs) fro (dsubmx (Z k)))%R /\
  (number lo ^+ 2 * (\sum_(k < size Zs) fro (dsubmx (Z k))) <= \sum_(k < size Zs) fro (W sys *m usubmx (Z k)))%R.
Proof.
move=> /andP [/(@number_gt0 R) v0 /(@number_le R)]; rewrite 2!numberM -expr2 => ov Z.
have -> : \sum_(k < size Zs) fro (dsubmx (Z k)) = number (total (size Zs) (fun k => tfro (m + q) r (drop n (nth [::] Zs k)))).
  by rewrite number_total; apply: eq_bigr => k _; rewrite number_fro mat_down.
split=> //; apply: le_trans ov _; rewrite number_total; apply: ler_sum => k _.
by rewrite number_fro mat_mul mat_up.
Qed.

Lemma cycle_sound watched Ls r turn way cycle lo g : check_cycle watched Ls r turn way cycle lo ->
  bounded sys (fun _ _ => watched) (cyclic R n p Ls) g -> 0 <= g -> number lo <= g.
Proof.
move=> /and5P [/and3P [N0 /eqP sL /eqP sC] /and3P [pre0 /eqP whole /(mat_same R) start] links watch /wins_sound [v0 ov]].
case/and5P: links => /(mat_same R) orth on_way arrives on_cycle turns bound g0.
have L_at k : (k < period s)%N -> step sys (cyclic R n p Ls) k = step sys (fun=> mat n p (nth [::] Ls k)) k.
  by move=> kN; rewrite /step /cyclic sL modn_small.
have S_at k Z Z' : leads r (nth [::] (mkseq (fun k => tstep (nth [::] Ls k) k) (period s)) (k %% period s)%N) Z Z' ->
    mat n r Z' = step sys (cyclic R n p Ls) k *m mat all_of r Z.
  rewrite (nth_mkseq [::]); last by rewrite ltn_mod.
  move=> linked; apply: (etrans (leads_sound linked)); apply: (congr1 (mulmx^~ _)).
  have turns' j : cyclic R n p Ls j = cyclic R n p Ls (j %% period s)%N by rewrite /cyclic sL modn_mod.
  by rewrite [RHS](step_mod k turns') L_at ?ltn_mod.
have S_in k Z Z' : (k < period s)%N -> leads r (nth [::] (mkseq (fun k => tstep (nth [::] Ls k) k) (period s)) k) Z Z' ->
    mat n r Z' = step sys (cyclic R n p Ls) k *m mat all_of r Z.
  by move=> kN; rewrite -{1}(modn_small kN) => /S_at.
have less k T : (k.+1 < T)%N -> k \in iota 0 T.-1 by rewrite mem_iota; case: T.
rewrite sC in v0 ov; have up Z : usubmx (mat all_of r Z) = mat n r Z by rewrite mat_up.
have := below_cycle (G := sys) (turn := mat r r turn) (way := fun t => mat all_of r (nth [::] way t)) (pre := size way)
  (cycle := fun t => mat all_of r (nth [::] cycle t)) bound N0 (cyclic_turns n p sL) S_turns.
apply=> //.
- by rewrite -mat_turn -mat_mul orth mat_scalar number1.
- by rewrite /dvdn whole.
- by rewrite up start mat_zero.
- by move=> t /less /(allP on_way) /S_at; rewrite up.
- by rewrite up (S_at _ _ _ arrives).
- by move=> t tN; rewrite up; apply: S_in (ltnW tN) _; apply: (allP on_cycle); apply: less.
- by rewrite up -mat_mul; apply: S_in turns; rewrite ltn_predL.
- by move=> w t tN; have /andP [/allP h _] := implyP watch w; apply/hidden_sound/h; rewrite mem_iota.
- by move=> w t tN; have /andP [_ /allP h] := implyP watch w; apply/hidden_sound/h; rewrite mem_iota.
Qed.

Lemma finite_sound r way lo g : check_finite r way lo ->
  bounded sys the_past (cyclic R n p [::]) g -> 0 <= g -> number lo <= g.
Proof.
move=> /and4P [N0 /andP [T0 /(mat_same R) start] /allP links /wins_sound [v0 ov]] bound g0.
apply: at_least g0 v0 ov _.
have less k : (k.+1 < size way)%N -> k \in iota 0 (size way).-1 by rewrite mem_iota; case: size.
apply: (below (G := sys) (Z := fun t => mat all_of r (nth [::] way t)) (live := fun t => t < size way)%N bound) => //.
- by rewrite mat_up start mat_zero.
- move=> t live; split; first exact: ltnW.
  have /andP [+ _] := links t (less t live); rewrite nth_mkseq ?ltn_mod // mat_up => /leads_sound ->.
  by rewrite [in RHS]step_mod => [|j]; rewrite /step /cyclic !nth_nil.
move=> k t kT tk; have live : (t.+1 < size way)%N := leq_ltn_trans tk kT; split; first exact: ltnW.
by apply: hidden_sound; have /andP [] := links t (less t live).
Qed.

Lemma width_sound lo up relative : check_width lo up relative -> within (number lo) (number up) (number relative).
Proof.
by move=> /andP [/(@number_le R) lo_up /(@number_le R)]; rewrite numberM numberD number1 /within lo_up.
Qed.

Lemma unseen k Ls : all (fun L => nilp L) Ls -> cyclic R n p Ls k = 0.
Proof.
move=> /(all_nthP [::]) none; rewrite /cyclic (_ : nth _ _ _ = [::]) ?mat_zero //.
by have [inside|outside] := ltnP (k %% size Ls) (size Ls); [apply/nilP/none | apply: nth_default].
Qed.

Variables (Ls Ps Fs : seq table) (room c lo up relative : Q) (r : nat) (turn : table) (way cycle : seq table).
Hypotheses (width : check_width lo up relative) (upper : check_above Ls Ps Fs up room c).
Local Notation L := (cyclic R n p Ls).

Theorem gain_proved : check_cycle false Ls r turn way cycle lo ->
  gain_between sys L (number lo) (number up) (number relative).
Proof.
have [? ? ? _ ?] := above_sound upper; move=> lower; split; first exact: width_sound.
by split=> // g g0 kept; apply: (cycle_sound lower) => //; apply: (keeps_bounded S_twice kept).
Qed.

Lemma optimum_from sees : (forall E g, uses sees E -> 0 <= g -> keeps sys E g -> number lo <= g) ->
  optimum_between sys sees (number lo) (number up) (number relative).
Proof.
have [? ? _ ? ?] := above_sound upper; split=> //; first exact: width_sound.
by exists L; split=> //; apply: observer_predicts.
Qed.

Theorem smoother_proved : check_cycle true (nseq (period s) [::]) r turn way cycle lo ->
  optimum_between sys everything (number lo) (number up) (number relative).
Proof.
move=> lower; apply: optimum_from => E g sight g0 kept; apply: (cycle_sound lower) => //.
by apply: (any_bounded (sees := everything) _ sight kept) => t; apply: unseen; rewrite all_nseq orbT.
Qed.

Theorem predictor_proved : check_finite r way lo ->
  optimum_between sys the_past (number lo) (number up) (number relative).
Proof.
move=> lower; apply: optimum_from => E g sight g0 kept; apply: (finite_sound lower) => //.
by apply: (any_bounded _ sight kept) => t; apply: unseen.
Qed.
End Sound.
End Plants.
