// As much of Unreal as an exported plugin uses, with its meaning.
#pragma once
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

using int32 = int32_t;
#define UCLASS(...)
#define UPROPERTY(...)
#define GENERATED_BODY() using Super = Base;
#define TEXT(words) words
#define UE_LOG(category, level, words) std::fprintf(stderr, "%s\n", words)
#define IMPLEMENT_MODULE(kind, name) kind name##_module;

struct FDefaultModuleImpl {};
struct FVector
{
    double X, Y, Z;
    FVector() : X(0), Y(0), Z(0) {}
    FVector(double a, double b, double c) : X(a), Y(b), Z(c) {}
    static const FVector ZeroVector;
    FVector operator+(const FVector& o) const { return {X + o.X, Y + o.Y, Z + o.Z}; }
    FVector operator-(const FVector& o) const { return {X - o.X, Y - o.Y, Z - o.Z}; }
    FVector& operator+=(const FVector& o) { return *this = *this + o; }
    bool Equals(const FVector& o, double t) const
    {
        return std::fabs(X - o.X) <= t && std::fabs(Y - o.Y) <= t && std::fabs(Z - o.Z) <= t;
    }
    static FVector CrossProduct(const FVector& a, const FVector& b)
    {
        return {a.Y * b.Z - a.Z * b.Y, a.Z * b.X - a.X * b.Z, a.X * b.Y - a.Y * b.X};
    }
    bool Normalize()
    {
        const double size = std::sqrt(X * X + Y * Y + Z * Z);
        if (size > 0) *this = {X / size, Y / size, Z / size};
        return size > 0;
    }
};
inline FVector operator*(double s, const FVector& v) { return {s * v.X, s * v.Y, s * v.Z}; }
inline const FVector FVector::ZeroVector;
struct FVector2D {};
struct FLinearColor {};
struct FProcMeshTangent {};

template <class T> struct TArray
{
    std::vector<T> own;
    int32 Add(const T& value) { own.push_back(value); return Num() - 1; }
    void Init(const T& value, int32 count) { own.assign(count, value); }
    void Reset() { own.clear(); }
    int32 Num() const { return int32(own.size()); }
    T* GetData() { return own.data(); }
    T& operator[](int32 i) { return own.at(i); }
    const T& operator[](int32 i) const { return own.at(i); }
    auto begin() { return own.begin(); }
    auto end() { return own.end(); }
};
template <class T> using TObjectPtr = T*;

struct FTransform // a turn of 90° about z, and a shift
{
    FVector Shift;
    FVector TransformVectorNoScale(const FVector& v) const { return {-v.Y, v.X, v.Z}; }
    FVector InverseTransformPositionNoScale(const FVector& p) const
    {
        const FVector v = p - Shift;
        return {v.Y, -v.X, v.Z};
    }
};
struct UObject { virtual ~UObject() {} };
struct USceneComponent : UObject {};
struct UPrimitiveComponent : USceneComponent
{
    FVector Pushed;
    bool IsSimulatingPhysics() const { return true; }
    FVector Turned, At;
    void AddForce(const FVector& force) { Pushed = force; }
    void AddForceAtLocation(const FVector& force, const FVector& place) { Pushed = force, At = place; }
    void AddTorqueInRadians(const FVector& torque) { Turned = torque; }
};
template <class T> T* Cast(UObject* thing) { return dynamic_cast<T*>(thing); }
struct AActor : UObject
{
    FVector Place;
    UPrimitiveComponent Root;
    FVector GetActorLocation() const { return Place; }
    USceneComponent* GetRootComponent() { return &Root; }
};
enum ELevelTick { LEVELTICK_All };
struct FActorComponentTickFunction { bool bCanEverTick = false; };
struct UProceduralMeshComponent : UPrimitiveComponent
{
    using Base = UProceduralMeshComponent;
    FActorComponentTickFunction PrimaryComponentTick;
    FTransform Frame;
    TArray<FVector> Vertices, Directions;
    virtual void BeginPlay() {}
    virtual void TickComponent(float, ELevelTick, FActorComponentTickFunction*) {}
    const FTransform& GetComponentTransform() const { return Frame; }
    FVector GetComponentScale() const { return {1.0, 1.0, 1.0}; }
    int32 GetNumSections() const { return Vertices.Num() > 0; }
    void CreateMeshSection_LinearColor(int32, const TArray<FVector>& places, const TArray<int32>&,
        const TArray<FVector>& normals, const TArray<FVector2D>&, const TArray<FLinearColor>&,
        const TArray<FProcMeshTangent>&, bool)
    {
        Vertices = places;
        Directions = normals;
    }
    void UpdateMeshSection_LinearColor(int32, const TArray<FVector>& places, const TArray<FVector>& normals,
        const TArray<FVector2D>&, const TArray<FLinearColor>&, const TArray<FProcMeshTangent>&)
    {
        Vertices = places;
        Directions = normals;
    }
};
