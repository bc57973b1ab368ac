(* What is proved of observers for several sensors with periods of their own. With the decimals of the paper, this is
   all that a reader must trust. Numbers of equations are those of Okajima, Hosoe and Hagiwara. *)
From Coq Require Import QArith_base.
From mathcomp Require Import all_ssreflect all_algebra.
Set Implicit Arguments. Unset Strict Implicit. Import GRing.Theory Num.Theory. Local Open Scope ring_scope.

(* The plant (2) and the weight of (18), by rows. *)
Definition table := seq (seq Q).
Record plant := Plant { tA : table; tBu : table; tBd : table; tC : table; tD : table; tW : table }.
(* For each sensor in use: its row of C and D, its period and its offset. *)
Definition schedule := seq (nat * nat * nat).
Definition period (s : schedule) := foldr (fun e => lcmn e.1.2) 1%N s.
Definition measured (s : schedule) k i := has (fun e => (e.1.1 == i) && (k == e.2 %[mod e.1.2])) s.

Section Statement.
(* Any ordered field without infinitely large elements: the rationals, the real numbers. *)
Variable R : archiFieldType.
Definition integer (a : Z) : R :=
  match a with Z0 => 0 | Zpos p => (Pos.to_nat p)%:R | Zneg p => - (Pos.to_nat p)%:R end.
Definition number (a : Q) : R := integer (Qnum a) / integer (Zpos (Qden a)).
Definition mat m n (t : table) : 'M[R]_(m, n) := \matrix_(i, j) number (nth (Qmake 0 1) (nth [::] t i) j).
Definition cyclic m n (ts : seq table) k : 'M[R]_(m, n) := mat m n (nth [::] ts (k %% size ts)).
Definition sq n (x : 'cV[R]_n) : R := \sum_i x i 0 ^+ 2.
Definition posdef n (M : 'M[R]_n) := M^T = M /\ forall x : 'cV_n, x != 0 -> 0 < (x^T *m M *m x) 0 0.

(* A plant in numbers of R under a schedule: S_k as in (5)-(6), which repeats after N instants. *)
Record system n nu m p q z := System { A : 'M[R]_n; Bu : 'M[R]_(n, nu); Bd : 'M[R]_(n, m); C : 'M[R]_(p, n);
  D : 'M[R]_(p, q); W : 'M[R]_(z, n); S : nat -> 'M[R]_p; N : nat }.
Definition wide (t : table) := size (nth [::] t 0).
Definition under (G : plant) (s : schedule) :=
  @System (size (tA G)) (wide (tBu G)) (wide (tBd G)) (size (tC G)) (wide (tD G)) (size (tW G))
    (mat _ _ (tA G)) (mat _ _ (tBu G)) (mat _ _ (tBd G)) (mat _ _ (tC G)) (mat _ _ (tD G)) (mat _ _ (tW G))
    (fun k => diag_mx (\row_i (measured s k i)%:R)) (period s).

Section System.
Variables (n nu m p q z : nat) (G : system n nu m p q z).
(* The state (2), what is measured of it (13), and the state of the observer (15), from any first states. *)
Fixpoint state (x0 : 'cV[R]_n) (u : nat -> 'cV_nu) (d : nat -> 'cV_m) k : 'cV_n :=
  if k is t.+1 then A G *m state x0 u d t + Bu G *m u t + Bd G *m d t else x0.
Definition output x0 u d (w : nat -> 'cV_q) k : 'cV_p := S G k *m (C G *m state x0 u d k + D G *m w k).
Fixpoint observed (L : nat -> 'M[R]_(n, p)) (x0 : 'cV[R]_n) (u : nat -> 'cV_nu) (y : nat -> 'cV_p) k : 'cV_n :=
  if k is t.+1 then (A G - L t *m S G t *m C G) *m observed L x0 u y t + Bu G *m u t + L t *m S G t *m y t else x0.

(* Whatever answers known inputs and measurements with estimates of W x. The instants t that it sees for its estimate
   at k are all (a smoother), or those before k (a predictor). *)
Definition estimator := (nat -> 'cV[R]_nu) -> (nat -> 'cV[R]_p) -> nat -> 'cV[R]_z.
Definition uses (sees : rel nat) (E : estimator) := forall k u u' y y',
  (forall t, sees t k -> u t = u' t /\ y t = y' t) -> E u y k = E u' y' k.
Definition everything : rel nat := fun t k => true.
Definition the_past : rel nat := fun t k => (t < k)%N.
Definition observer L : estimator := fun u y k => W G *m observed L 0 u y k.
(* From rest, the energy of the error is at most g^2 times that of the disturbances, up to every instant: its l2 gain
   is at most g. *)
Definition keeps (E : estimator) (g : R) := forall u d w T,
  \sum_(k < T) sq (W G *m state 0 u d k - E u (output 0 u d w) k) <= g ^+ 2 * \sum_(k < T) (sq (d k) + sq (w k)).
(* Undisturbed, plant and observer come together exponentially, whatever their first states. *)
Definition stable L := exists c r : R, [/\ 0 <= r, r < 1 & forall x0 x1 u k, let none j := fun _ : nat => (0 : 'cV_j) in
  sq (state x0 u (none m) k - observed L x1 u (output x0 u (none m) (none q)) k) <= c * r ^+ k * sq (x0 - x1)].

(* Theorems 1 and 2: the matrices (20) and (30) at k, where P_(k-1) is P_(k+N-1). *)
Definition periodic T (f : nat -> T) := forall k, f (k + N G)%N = f k.
Definition rest (P : nat -> 'M[R]_n) (g : R) k : 'M_(n + (m + q)) :=
  block_mx (P (k + (N G).-1)%N - (W G)^T *m W G) 0 0 (g ^+ 2)%:M.
Definition Theta P L g k := let M := row_mx (A G - L k *m S G k *m C G) (row_mx (Bd G) (- (L k *m S G k *m D G))) in
  rest P g k - M^T *m P k *m M.
Definition Theta_hat P Y g k := let M := row_mx (P k *m A G - Y k *m S G k *m C G)
  (row_mx (P k *m Bd G) (- (Y k *m S G k *m D G))) in block_mx (P k) M M^T (rest P g k).
Definition theorem1 L g := exists2 P, periodic P & forall k, posdef (P k) /\ posdef (Theta P L g k).
Definition theorem2 g := exists P Y, [/\ periodic P, periodic Y & forall k, posdef (P k) /\ posdef (Theta_hat P Y g k)].

(* The gains L make the error system stable, with a gain between lo and up. *)
Definition within (lo up relative : R) := lo <= up <= lo * (1 + relative).
Definition gain_between L lo up relative := within lo up relative /\
  [/\ periodic L, stable L, theorem1 L up, keeps (observer L) up & forall g, 0 <= g -> keeps (observer L) g -> lo <= g].
(* Some observer, which predicts, reaches up by Theorem 2; no estimator that sees these instants goes below lo. *)
Definition optimum_between sees lo up relative := [/\ within lo up relative, theorem2 up,
  exists L, [/\ periodic L, uses the_past (observer L), stable L & keeps (observer L) up]
  & forall E g, uses sees E -> 0 <= g -> keeps E g -> lo <= g].
End System.
End Statement.
